# Writes sentences into a small tree and asks TOOL about them: each figurative word is named with
# its place and the word to say instead, and honest words pass. An @ divides the words of this
# source, because the tool reads it too.

# passes(FILE TEXT): a line of which the tool says nothing.
function(passes file text)
  string(REPLACE "@" "" text "${text}")
  file(APPEND ${WORK_DIR}/${file} "${text}\n")
endfunction()

# refused(FILE TEXT [WORD SAY]...): a line of which the tool says these, in alphabetical order.
function(refused file text)
  passes(${file} "${text}")
  file(STRINGS ${WORK_DIR}/${file} lines)
  list(LENGTH lines number)
  while(ARGN)
    list(POP_FRONT ARGN word say)
    string(REPLACE "@" "" word "${word}")
    string(APPEND expected "${file}:${number}: \"${word}\": say \"${say}\"\n")
  endwhile()
  set(expected "${expected}" PARENT_SCOPE)
endfunction()

# expect(STATUS OUTPUT): what the tool makes of the tree.
function(expect status output)
  execute_process(COMMAND ${TOOL} --source ${WORK_DIR}
    RESULT_VARIABLE found_status OUTPUT_VARIABLE found ERROR_VARIABLE found)
  if(NOT found_status STREQUAL status OR NOT found STREQUAL output)
    message(SEND_ERROR "status ${found_status}, not ${status}:\n${found}\nexpected:\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
passes(fit/honest.h "/// The cost is rough here, as linen is. A start may be roughly right.")
passes(fit/honest.h "/// The springs amount to a continuum. An outlier pulls by a bounded amount.")
passes(fit/honest.h "/// The force law of a spring, a proposed law, Newton's second law.")
passes(fit/honest.h "/// Cloth settles within a second. The formatter settles the layout.")
passes(fit/honest.h "/// The line of sight of a pixel, a line of the table, an error in line 12.")
passes(fit/honest.h "/// What is left out of the fit, and what is left over in the end.")
passes(fit/honest.h "json[\"fore@seen_fall\"] = law_terms;  // --me@nd-terms, \"fore@seen\"")
passes(docs/honest.md "The key `val@ley` of the file. We recommend the amended text.")
passes(docs/log.md "The first search went through every val@ley a@new.")
passes(tests/fixtures/note.md "A val@ley.")
passes(build/note.md "A val@ley.")
passes(data/places.csv "val@ley")
expect(0 "")

set(expected "")
refused(CMakeLists.txt "# Configures a@new." a@new "from scratch")
refused(cmake/Parts.cmake "# A d@ear part." d@ear expensive)
refused(docs/page.md "The deepest Val@ley." val@ley basin)
refused(docs/page.md "La@ws of every effect are tried." law mode)
refused(fit/a.h "/// The fore@seen fall." fore@seen predicted)
refused(fit/a.h "/// Derivatives fore@tell it." fore@tell predict)
refused(fit/a.h "/// A model that is hope@lessly far off." hope@less "grossly misfitting")
refused(fit/a.h "/// Constants me@nd the rest." me@nd "correct or remove")
refused(fit/a.h "/// It ow@es to leave less." ow@es "must still beat")
refused(fit/a.h "/// Goes on from a ro@ugh fit." ro@ugh unrefined)
refused(fit/a.h "/// A fit that did not se@ttle." se@ttle converge)
refused(fit/a.h "/// The am@ount of the effect." am@ount "amplitude beyond neutral")
refused(fit/a.h "/// Structure in what is le@ft." "what is le@ft" residual)
refused(fit/a.h "/// The best li@ne goes on." li@ne "beam entry")
refused(fit/a.h "/// Drops the accepted la@w." la@w mode)
refused(tests/fit/a_test.cpp "  // Begins a@new in every val@ley."
  a@new "from scratch" val@ley basin)
expect(1 "${expected}")
file(REMOVE_RECURSE ${WORK_DIR})
