# Who may include and link whom: every folder is a library with arrows of its own. One include root
# would let a header cross a boundary with no link to show for it, so the includes themselves are
# read. A header in the place of a folder: of that folder, this header only.
#
#   apps -> vision -> calib/* -> calib/camera -> data
#   apps -> fit    -> model                   -> data/input_error.h, data/parallel.h,
#                                                        data/algebra
#           fit    -> calib/camera

# A script has no project to take its policies from; a function keeps those of its definition.
if(CMAKE_SCRIPT_MODE_FILE)
  cmake_minimum_required(VERSION 3.25)
endif()

set(CLOTHFIT_ARROWS
  "data/algebra         ->"
  "data                 -> data/algebra"
  "calib/camera         -> data"
  "calib/bundle         -> data/algebra data calib/camera"
  "calib/placement      -> data/algebra data calib/camera calib/bundle"
  "calib/boards         -> data calib/camera calib/bundle calib/placement"
  "vision/degrade       -> data"
  "vision/encode        -> data"
  "vision/ingest        -> data"
  "vision/detect        -> data"
  "vision/texture       -> data calib/camera vision/detect"
  "vision/track         -> data vision/ingest vision/detect vision/texture"
  "vision/look          -> data vision/ingest vision/detect vision/track"
  "vision/print         -> data vision/detect"
  "vision/render        -> data calib/camera vision/detect"
  "model/topology       -> data/input_error.h"
  "model/kernels        -> model/topology"
  "model/fabric         -> data/input_error.h data/algebra model/topology"
  "model/cloth          -> data/input_error.h model/topology model/kernels model/fabric"
  "model/effects        -> data/input_error.h model/topology model/kernels model/cloth"
  "model/rest           -> data/input_error.h data/parallel.h data/algebra model/topology
                           model/kernels model/cloth"
  "model/sheet          -> model/topology model/fabric model/rest"
  "model/laboratory     -> data/input_error.h data/parallel.h model/topology model/fabric
                           model/rest model/sheet"
  "model/garment        -> data/input_error.h data/sewing_pattern.h model/topology model/fabric
                           model/rest model/sheet"
  "model/integrate      -> data/input_error.h data/parallel.h data/algebra model/kernels
                           model/cloth model/effects model/rest"
  "fit/interface        -> data model/fabric"
  "fit/jobs             -> data fit/interface/option_limits.h"
  "fit/observe          -> data/algebra data calib/camera model/topology fit/interface
                           fit/jobs"
  "fit/measurement_effects -> data model/cloth model/effects fit/observe"
  "fit/problem          -> data/algebra data calib/camera model/topology model/fabric
                           model/cloth model/effects model/integrate fit/interface fit/observe
                           fit/measurement_effects"
  "fit/preflight        -> data calib/camera model/topology fit/interface fit/observe
                           fit/measurement_effects fit/problem"
  "fit/cost             -> data/algebra data model/cloth model/integrate fit/interface
                           fit/observe fit/problem"
  "fit/search           -> data/algebra data fit/interface fit/jobs fit/problem fit/cost"
  "fit/refine           -> data/algebra data model/cloth fit/interface fit/jobs fit/problem
                           fit/cost"
  "fit/uncertainty      -> data/algebra data fit/interface fit/jobs fit/problem fit/cost
                           fit/refine"
  "fit/verdict          -> data fit/interface"
  "fit                  -> data model/cloth fit/interface fit/verdict fit/jobs fit/observe fit/problem fit/cost
                           fit/search fit/refine fit/uncertainty"
  "fit/diagnosis        -> data/algebra data calib/camera model/cloth model/effects
                           model/integrate fit/interface fit/jobs fit/observe
                           fit/measurement_effects fit/problem fit/cost fit/refine
                           fit/uncertainty fit"
  "apps/terminal        -> data"
  "apps/steps           -> data calib/placement calib/boards vision/encode vision/ingest
                           vision/detect vision/track vision/look fit/interface fit/observe
                           fit/verdict fit fit/diagnosis apps/terminal"
  "apps/report/page     -> apps/terminal"
  "apps/report/fit      -> data vision/encode vision/ingest fit/interface apps/terminal
                           apps/report/page"
  "apps/report/diagnosis -> data fit/problem fit/diagnosis apps/terminal apps/report/page
                           apps/report/fit"
  "apps/report/garment  -> model/rest model/garment apps/terminal apps/report/page"
  "apps/study/scene     -> data/algebra data calib/camera vision/encode vision/track vision/render
                           model/topology model/fabric model/cloth model/effects
                           model/integrate fit/jobs fit/measurement_effects fit/problem fit
                           fit/diagnosis"
  "apps/study/trials    -> data/algebra data model/cloth fit/interface fit/jobs
                           fit/measurement_effects
                           fit/problem fit/cost fit/refine fit/uncertainty fit/diagnosis
                           apps/study/scene"
  "apps/study/louchet1995 -> data/algebra data model/fabric model/effects fit/jobs fit/problem
                             fit/cost fit/search fit/refine"
  "apps/study/lethanh2007 -> data model/topology model/rest model/garment fit/jobs"
  "apps/study/recordings -> data fit/jobs fit/observe fit/problem fit apps/terminal apps/steps
                            apps/report/fit"
  "apps/study/foreign   -> data fit/jobs fit/diagnosis apps/terminal apps/steps
                           apps/study/recordings"
  "apps/study/vision    -> data calib/camera vision/degrade vision/ingest vision/detect vision/track
                           vision/render model/topology fit/interface fit/jobs fit/observe
                           fit/diagnosis apps/terminal apps/steps"
  "apps/report/study    -> data vision/track model/garment apps/terminal apps/report/page
                           apps/report/fit apps/report/garment
                           apps/study/trials apps/study/louchet1995 apps/study/lethanh2007
                           apps/study/recordings apps/study/foreign apps/study/vision"
  "apps/verbs           -> data vision/encode vision/detect vision/track vision/look vision/print
                           vision/render
                           model/topology model/fabric model/cloth model/effects model/rest
                           model/garment model/laboratory model/integrate
                           fit/interface fit/jobs fit/measurement_effects
                           fit/problem fit/preflight fit/verdict fit fit/diagnosis apps/terminal
                           apps/steps apps/report/page apps/report/fit apps/report/diagnosis
                           apps/report/garment apps/study/trials apps/study/louchet1995
                           apps/study/lethanh2007 apps/study/recordings
                           apps/study/foreign apps/study/vision apps/report/study"
  "apps                 -> data apps/terminal apps/verbs"
)

# Tests know their own room and what it may know, as a whole.
set(CLOTHFIT_TEST_ARROWS
  "tests/data   -> data"
  "tests/calib  -> calib data"
  "tests/vision -> vision calib data tests/data tests/model"
  "tests/model  -> model data tests/data"
  "tests/fit    -> fit model calib data tests/data"
  "tests/apps   -> apps fit model vision calib data tests/data"
  "tests/fuzz   -> apps fit model vision calib data"
  "tests/faults -> apps fit model vision calib data tests/apps tests/data"
  "tests/bench  -> fit model vision calib data tests/model tests/vision"
)

# What `folder` may include: a list in `result`.
function(clothfit_arrows_of folder result)
  set(${result} "NOTFOUND" PARENT_SCOPE)
  foreach(arrow IN LISTS CLOTHFIT_ARROWS CLOTHFIT_TEST_ARROWS)
    if(arrow MATCHES "^([^ ]+) +->(.*)$" AND CMAKE_MATCH_1 STREQUAL folder)
      string(REGEX MATCHALL "[^ \n]+" targets "${CMAKE_MATCH_2}")
      set(${result} "${targets}" PARENT_SCOPE)
      return()
    endif()
  endforeach()
endfunction()

# Every "PATH" and <PATH> that a file of ours includes by its room: a list in `result`.
function(clothfit_includes_of file result)
  file(STRINGS ${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]+[\"<][^\">]+[\">]")
  set(includes "")
  foreach(line IN LISTS lines)
    string(REGEX REPLACE ".*[\"<]([^\">]+)[\">].*" "\\1" included "${line}")
    if(included MATCHES "^(\\.\\.?|data|calib|vision|model|fit|apps|tests)/")
      list(APPEND includes "${included}")
    endif()
  endforeach()
  set(${result} "${includes}" PARENT_SCOPE)
endfunction()

# Stops with every forbidden include under `source_dir` named, file and line.
function(clothfit_check_arrows source_dir)
  set(problems "")
  foreach(room data calib vision model fit apps tests)
    file(GLOB_RECURSE files RELATIVE ${source_dir}
      ${source_dir}/${room}/*.h ${source_dir}/${room}/*.cpp ${source_dir}/${room}/*.inc)
    foreach(file IN LISTS files)
      get_filename_component(folder ${file} DIRECTORY)
      if(room STREQUAL "tests")
        string(REGEX MATCH "^tests/[^/]+" folder ${file})
      endif()
      clothfit_arrows_of(${folder} arrows)
      if(arrows STREQUAL "NOTFOUND")
        list(APPEND problems "${file}: ${folder} has no arrows")
        continue()
      endif()
      clothfit_includes_of(${source_dir}/${file} includes)
      foreach(included IN LISTS includes)
        if(included MATCHES "^\\.")
          list(APPEND problems "${file}: includes \"${included}\"; name the room instead")
          continue()
        endif()
        get_filename_component(target ${included} DIRECTORY)
        if(room STREQUAL "tests")
          # A whole room, and the tests' own folders.
          string(REGEX MATCH "^(tests/)?[^/]+" target ${included})
        endif()
        if(NOT target STREQUAL folder AND NOT target IN_LIST arrows
           AND NOT included IN_LIST arrows)
          list(APPEND problems "${file}: includes \"${included}\"; ${folder} may not know ${target}")
        endif()
      endforeach()
    endforeach()
  endforeach()
  if(problems)
    list(JOIN problems "\n  " text)
    message(FATAL_ERROR "Forbidden arrows between folders:\n  ${text}\n"
      "The arrows are listed in cmake/ClothfitArrows.cmake.")
  endif()
endfunction()

# Stops where sources with their headers include each other in a circle. A header and the source of
# its name count as one; so a header may not even be known to what its source needs.
function(clothfit_check_include_cycles source_dir)
  set(units "")
  foreach(room data calib vision model fit apps)
    file(GLOB_RECURSE files RELATIVE ${source_dir}
      ${source_dir}/${room}/*.h ${source_dir}/${room}/*.cpp)
    foreach(file IN LISTS files)
      string(REGEX REPLACE "\\.(h|cpp)$" "" unit ${file})
      list(APPEND units ${unit})
      clothfit_includes_of(${source_dir}/${file} includes)
      foreach(included IN LISTS includes)
        string(REGEX REPLACE "\\.(h|inc)$" "" target ${included})
        if(NOT target STREQUAL unit AND (EXISTS ${source_dir}/${target}.h
                                         OR EXISTS ${source_dir}/${target}.cpp))
          list(APPEND needs_${unit} ${target})
        endif()
      endforeach()
    endforeach()
  endforeach()
  list(REMOVE_DUPLICATES units)
  # Units that need nothing any more are put aside until none is left.
  set(moved TRUE)
  while(units AND moved)
    set(moved FALSE)
    set(left "")
    foreach(unit IN LISTS units)
      foreach(need IN LISTS needs_${unit})
        if(NOT done_${need})
          list(APPEND left ${unit})
          break()
        endif()
      endforeach()
      if(NOT unit IN_LIST left)
        set(done_${unit} TRUE)
        set(moved TRUE)
      endif()
    endforeach()
    set(units ${left})
  endwhile()
  if(units)
    list(JOIN units "\n  " text)
    message(FATAL_ERROR "These include each other in a circle, or need what does:\n  ${text}")
  endif()
endfunction()

# `cmake -D SOURCE_DIR=... -P ClothfitArrows.cmake` checks a tree by itself.
if(CMAKE_SCRIPT_MODE_FILE AND DEFINED SOURCE_DIR)
  clothfit_check_arrows(${SOURCE_DIR})
  clothfit_check_include_cycles(${SOURCE_DIR})
endif()
