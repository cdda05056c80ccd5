# One library per folder, one test program per room.

find_program(CLOTHFIT_CCACHE ccache)
if(CLOTHFIT_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Precompiled headers need ccache to be told what it may ignore.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env
    CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
    ${CLOTHFIT_CCACHE})
endif()

add_library(clothfit_warnings INTERFACE)
target_compile_options(clothfit_warnings INTERFACE
  -Wall -Wextra -Wconversion -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
  -Wno-missing-field-initializers  # a designated initialiser leaves defaults out on purpose
  $<$<CXX_COMPILER_ID:Clang>:-Wno-sign-conversion>  # g++'s -Wconversion leaves it out in C++
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)  # g++ 12 sees overlaps in std::string's operator+ that are not there (PR 105651)
if(CLOTHFIT_WARNINGS_AS_ERRORS)
  target_compile_options(clothfit_warnings INTERFACE -Werror)
endif()

# clothfit_add_folder(FOLDER SOURCES a.cpp ... [PUBLIC lib ...] [PRIVATE lib ...])
# The library of a folder, clothfit::FOLDER with _ for /. It links what its arrows name
# (ClothfitArrows.cmake); PUBLIC and PRIVATE are libraries of others, seen in headers or not.
# The single include root lets every include name its folder: "model/integrate/step.h".
# A release build compiles about eight sources at a time, in batches of one size (CMAKE_UNITY_BUILD).
function(clothfit_add_folder folder)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  string(REPLACE "/" "_" name ${folder})
  add_library(clothfit_${name} STATIC ${ARG_SOURCES})
  add_library(clothfit::${name} ALIAS clothfit_${name})
  target_include_directories(clothfit_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/clothfit>)
  clothfit_arrows_of(${folder} arrows)
  set(folders "")
  foreach(arrow IN LISTS arrows)
    string(REGEX REPLACE "/[a-z_0-9]+\\.h$" "" arrow ${arrow})  # a header stands for its folder
    string(REPLACE "/" "_" arrow ${arrow})
    list(APPEND folders clothfit::${arrow})
  endforeach()
  target_link_libraries(clothfit_${name}
    PUBLIC ${folders} ${ARG_PUBLIC}
    PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:clothfit_warnings>)
  list(LENGTH ARG_SOURCES count)
  math(EXPR batches "(${count} + 4) / 8")
  if(batches GREATER 0)
    math(EXPR size "(${count} + ${batches} - 1) / ${batches}")
    set_target_properties(clothfit_${name} PROPERTIES UNITY_BUILD_BATCH_SIZE ${size})
  endif()
  # The command line and the reports compile in two thirds of the time so. They compute little, and
  # what they share inline with the libraries is no hot loop.
  if(folder MATCHES "^apps/(report|steps|terminal|verbs)")
    target_compile_options(clothfit_${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
  set_property(GLOBAL APPEND PROPERTY CLOTHFIT_LIBRARIES ${name})
endfunction()

# clothfit_add_room(ROOM FOLDER ...): clothfit::ROOM, all of them at once.
function(clothfit_add_room room)
  add_library(clothfit_${room} INTERFACE)
  add_library(clothfit::${room} ALIAS clothfit_${room})
  foreach(folder ${ARGN})
    target_link_libraries(clothfit_${room} INTERFACE clothfit::${room}_${folder})
  endforeach()
  set_property(GLOBAL APPEND PROPERTY CLOTHFIT_LIBRARIES ${room})
endfunction()

# clothfit_add_test(ROOM SOURCES a_test.cpp ... [LINK lib ...] [LABELS slow] [COST seconds])
# Builds and registers, so that no test is compiled but never run. Tests run in the order of their
# cost, so that no long one is left alone at the end; slow ones cost 5 unless COST says more.
function(clothfit_add_test room)
  cmake_parse_arguments(ARG "" "NAME;COST" "SOURCES;LINK;LABELS" ${ARGN})
  if(NOT ARG_COST)
    set(ARG_COST 0)
    if("slow" IN_LIST ARG_LABELS)
      set(ARG_COST 5)
    endif()
  endif()
  if(NOT ARG_NAME)
    set(ARG_NAME clothfit_${room}_tests)
  endif()
  add_executable(${ARG_NAME} ${ARG_SOURCES})
  target_include_directories(${ARG_NAME} PRIVATE ${PROJECT_SOURCE_DIR})
  # Before all others, the C++ library itself: googletest wants some of its templates, of which our
  # archives hold copies, and each copy brings its object and all that this needs.
  target_link_libraries(${ARG_NAME} PRIVATE $<$<CXX_COMPILER_ID:GNU>:stdc++>
    clothfit::${room} ${ARG_LINK} GTest::gtest_main GTest::gmock clothfit_warnings)
  target_precompile_headers(${ARG_NAME} REUSE_FROM clothfit_test_headers)
  target_compile_definitions(${ARG_NAME} PRIVATE
    CLOTHFIT_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  # Sanitizers slow tests down: on a busy machine the slowest take more than ten minutes.
  set(seconds 600)
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    set(seconds 1800)
  endif()
  gtest_discover_tests(${ARG_NAME}
    DISCOVERY_TIMEOUT 60
    PROPERTIES LABELS ${room} TIMEOUT ${seconds} COST ${ARG_COST})
  # Discovery takes no lists: a second label would shift the properties behind it.
  if(ARG_LABELS)
    set(labels ${CMAKE_CURRENT_BINARY_DIR}/${ARG_NAME}_labels.cmake)
    file(CONFIGURE OUTPUT ${labels} @ONLY CONTENT
"foreach(test IN LISTS @ARG_NAME@_TESTS)
  set_tests_properties(\${test} PROPERTIES LABELS \"@room@;@ARG_LABELS@\")
endforeach()
")
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${labels})
  endif()
endfunction()
