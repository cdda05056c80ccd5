# The rooms and who may include whom. One include root would let a header cross
# a boundary with no link to show for it, so the includes themselves are read.
#
#   apps -> vision -> calib -> camera -> data
#   apps -> fit    -> model           -> data (input_error.h and algebra/ only)
#           fit    -> camera
#
# `camera` is the part of calib/ that needs Eigen only: see its list of headers.

# A script has no project to take its policies from; a function keeps those of its definition.
if(CMAKE_SCRIPT_MODE_FILE)
  cmake_minimum_required(VERSION 3.25)
endif()

set(CLOTHFIT_CAMERA_HEADERS projection.h projection_impl.h rigid3.h)
set(CLOTHFIT_ARROWS_data   "data")
set(CLOTHFIT_ARROWS_calib  "calib;data")
set(CLOTHFIT_ARROWS_vision "vision;calib;data")
set(CLOTHFIT_ARROWS_model  "model")
set(CLOTHFIT_ARROWS_fit    "fit;model;data")
set(CLOTHFIT_ARROWS_apps   "apps;vision;calib;fit;model;data")

# Stops with every forbidden include under SOURCE_DIR named, file and line.
function(clothfit_check_arrows)
  set(source_dir ${CMAKE_CURRENT_SOURCE_DIR})
  if(ARGC GREATER 0)
    set(source_dir ${ARGV0})
  endif()
  set(rooms data calib vision model fit apps)
  set(problems "")
  foreach(room IN LISTS rooms)
    file(GLOB_RECURSE files ${source_dir}/${room}/*.h ${source_dir}/${room}/*.cpp)
    foreach(file IN LISTS files)
      file(STRINGS ${file} includes REGEX "^[ \t]*#[ \t]*include[ \t]+[\"<][^\">]+[\">]")
      foreach(line IN LISTS includes)
        string(REGEX REPLACE ".*[\"<]([^\">]+)[\">].*" "\\1" included "${line}")
        string(REGEX MATCH "^[^/]+" target "${included}")
        file(RELATIVE_PATH where ${source_dir} ${file})
        if(included MATCHES "^\\.\\.?/")
          list(APPEND problems "${where}: includes \"${included}\"; name the room instead")
          continue()
        endif()
        if(NOT target IN_LIST rooms OR NOT included MATCHES "/")
          continue()
        endif()
        if(target IN_LIST CLOTHFIT_ARROWS_${room})
          continue()
        endif()
        if(room STREQUAL "model" AND included MATCHES "^data/(input_error\\.h|algebra/)")
          continue()
        endif()
        string(REGEX REPLACE "^calib/" "" camera_header "${included}")
        if(room STREQUAL "fit" AND target STREQUAL "calib"
           AND camera_header IN_LIST CLOTHFIT_CAMERA_HEADERS)
          continue()
        endif()
        list(APPEND problems "${where}: includes \"${included}\"; ${room} may not know ${target}")
      endforeach()
    endforeach()
  endforeach()
  if(problems)
    list(JOIN problems "\n  " text)
    message(FATAL_ERROR "Forbidden arrows between rooms:\n  ${text}\n"
      "The arrows are listed in cmake/ClothfitArrows.cmake and CONTRIBUTING.md.")
  endif()
endfunction()

# `cmake -D SOURCE_DIR=... -P ClothfitArrows.cmake` checks a tree by itself.
if(CMAKE_SCRIPT_MODE_FILE AND DEFINED SOURCE_DIR)
  clothfit_check_arrows(${SOURCE_DIR})
endif()
