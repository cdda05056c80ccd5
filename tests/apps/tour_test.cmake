# Follows a page of SOURCE_DIR, docs/tour.md unless PAGE names another, with PROGRAM in WORK_DIR:
# runs the commands of its console blocks in order, and compares what each prints with the lines
# that the page shows. Whether the numbers are right is not asked here:
# tests/apps/demo_test.cpp and tests/fit/recordings_test.cpp do that.
#
# On the page, a line "..." stands for any number of lines. Blank lines do not count, nor do times
# such as "12.3 s". Blocks that begin with "```console whole" take half a minute or more together
# with those that need them; they run only where the environment has CLOTHFIT_WHOLE.

# A list of the lines of TEXT that are not blank, in characters that CMake's lists leave alone.
function(lines_of text result)
  string(REPLACE "\\" "<backslash>" text "${text}")
  string(REPLACE ";" "<semicolon>" text "${text}")
  string(REPLACE "[" "<bracket>" text "${text}")
  string(REPLACE "]" "</bracket>" text "${text}")
  string(REGEX REPLACE "[ \t\r]+\n" "\n" text "${text}\n")
  string(REGEX REPLACE "\n\n+" "\n" text "${text}")
  string(REGEX REPLACE "^\n|\n$" "" text "${text}")
  string(REPLACE "\n" ";" text "${text}")
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

# TEXT as it was before lines_of.
function(readable text result)
  string(REPLACE "<backslash>" "\\" text "${text}")
  string(REPLACE "<semicolon>" ";" text "${text}")
  string(REPLACE "<bracket>" "[" text "${text}")
  string(REPLACE "</bracket>" "]" text "${text}")
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

# Whether the lines `actual` are those of the page; `missing` is the first line that they lack, or
# the first that they have beyond the page's.
function(compare expected actual missing)
  set(${missing} "" PARENT_SCOPE)
  set(any FALSE)
  foreach(line IN LISTS expected)
    if(line STREQUAL "...")
      set(any TRUE)
      continue()
    endif()
    string(REGEX REPLACE "[0-9.]+ s($|[^A-Za-z0-9])" "TIME s\\1" line "${line}")
    set(found FALSE)
    while(NOT actual STREQUAL "")
      list(POP_FRONT actual next)
      string(REGEX REPLACE "[0-9.]+ s($|[^A-Za-z0-9])" "TIME s\\1" next "${next}")
      if(next STREQUAL line)
        set(found TRUE)
      endif()
      if(found OR NOT any)
        break()
      endif()
    endwhile()
    if(NOT found)
      set(${missing} "it lacks: ${line}" PARENT_SCOPE)
      return()
    endif()
    set(any FALSE)
  endforeach()
  if(NOT any AND NOT actual STREQUAL "")
    list(GET actual 0 next)
    set(${missing} "beyond the page's it has: ${next}" PARENT_SCOPE)
  endif()
endfunction()

# Runs one command of the page, its lines in `expected`.
function(follow command expected)
  readable("${command}" command)
  execute_process(COMMAND sh -c "${command}" WORKING_DIRECTORY ${WORK_DIR}
    OUTPUT_VARIABLE output ERROR_VARIABLE output)
  lines_of("${output}" actual)
  # A slow run writes how far it is, a line a minute; the page does not show that.
  list(FILTER actual EXCLUDE REGEX "^[0-9]+:[0-9][0-9]:[0-9][0-9]  ")
  compare("${expected}" "${actual}" missing)
  if(NOT missing STREQUAL "")
    readable("${missing}" missing)
    string(REPLACE "\n" "\n  " output "${output}")  # CMake keeps indented lines as they are
    message(SEND_ERROR "${PAGE} shows other lines for\n  $ ${command}\n  ${missing}\n"
      "All of what it printed:\n  ${output}")
  endif()
endfunction()

if(NOT DEFINED PAGE)
  set(PAGE docs/tour.md)
endif()
file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
file(CREATE_LINK ${SOURCE_DIR}/data ${WORK_DIR}/data SYMBOLIC)
get_filename_component(program_folder ${PROGRAM} DIRECTORY)
set(ENV{PATH} "${program_folder}:$ENV{PATH}")

file(READ ${SOURCE_DIR}/${PAGE} page)
lines_of("${page}" page)
set(count 0)
set(left_out 0)
set(state text)  # or `run`, or `skip`, inside a console block
set(command "")
set(expected "")
foreach(line IN LISTS page)
  if(NOT state STREQUAL "text" AND line MATCHES "^(```|[$] )")
    if(state STREQUAL "run" AND NOT command STREQUAL "")
      follow("${command}" "${expected}")
    endif()
    set(command "")
    set(expected "")
  endif()
  if(line STREQUAL "```console")
    set(state run)
  elseif(line STREQUAL "```console whole")
    set(state run)
    if(NOT DEFINED ENV{CLOTHFIT_WHOLE})
      set(state skip)
    endif()
  elseif(line STREQUAL "```")
    set(state text)
  elseif(NOT state STREQUAL "text" AND line MATCHES "^[$] (.*)$")
    set(command "${CMAKE_MATCH_1}")
    math(EXPR count "${count} + 1")
    if(state STREQUAL "skip")
      math(EXPR left_out "${left_out} + 1")
    endif()
  elseif(NOT state STREQUAL "text")
    list(APPEND expected "${line}")
  endif()
endforeach()

if(count EQUAL 0)
  message(SEND_ERROR "${PAGE} has no commands in console blocks")
endif()
if(left_out GREATER 0)
  message(STATUS "left out: ${left_out} of ${count} commands take half a minute and more; "
    "CLOTHFIT_WHOLE=1 runs them")
endif()
file(REMOVE_RECURSE ${WORK_DIR})
