# Builds a tree of two units with TOOL: the table has a line for each, and a build that fails says so.

file(REMOVE_RECURSE ${WORK_DIR})
file(WRITE ${WORK_DIR}/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(small LANGUAGES CXX)
add_subdirectory(room)
")
file(WRITE ${WORK_DIR}/room/CMakeLists.txt "add_executable(small one.cpp other.cpp)
")
file(WRITE ${WORK_DIR}/CMakePresets.json "{\"version\": 6, \"configurePresets\":
  [{\"name\": \"release\", \"generator\": \"Ninja\", \"binaryDir\": \"\${sourceDir}/build\"}]}
")
file(WRITE ${WORK_DIR}/room/one.cpp "int other();\nint main() { return other(); }\n")
file(WRITE ${WORK_DIR}/room/other.cpp "#include <string>\nint other() { return 0; }\n")

execute_process(COMMAND ${TOOL} --source ${WORK_DIR} small
  RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
foreach(expected "CPU seconds in 3 steps" " s +3 steps  room\n" " s  room/one.cpp\n"
        " s  room/other.cpp\n")
  if(NOT status EQUAL 0 OR NOT output MATCHES "${expected}")
    message(SEND_ERROR "status ${status}, and no '${expected}' in\n${output}")
  endif()
endforeach()

file(WRITE ${WORK_DIR}/room/other.cpp "int other() { return nothing; }\n")
execute_process(COMMAND ${TOOL} --source ${WORK_DIR} small
  RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(status EQUAL 0 OR NOT output MATCHES "other.cpp")
  message(SEND_ERROR "a build that failed counts as one: status ${status}\n${output}")
endif()
file(REMOVE_RECURSE ${WORK_DIR})
