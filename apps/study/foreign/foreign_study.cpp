#include "apps/study/foreign/foreign_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <system_error>

#include "apps/steps/steps.h"
#include "apps/study/recordings/recordings_checksum.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "apps/terminal/option_flags.h"
#include "data/folder_entries.h"
#include "data/input_error.h"
#include "data/text_file.h"
#include "fit/diagnosis/diagnose.h"
#include "fit/jobs/executor.h"
#include "fit/jobs/journal_key.h"
#include "fit/jobs/thread_limit.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTruthFile = "truth.json";

/// Copies what the study keeps of a diagnosis.
void note(const Diagnosis& diagnosis, ForeignDiagnosis& kept) {
  kept.verdict = diagnosis.verdict;
  kept.complete = diagnosis.complete;
  // This is never right: no recording hides such a thing.
  if (diagnosis.seen_elsewhere)
    kept.named.push_back(
        {.effect = "seen_elsewhere", .title = "markers seen elsewhere", .alike = {}});
  for (const AcceptedEffect& accepted : diagnosis.accepted) {
    const Hypothesis& own = accepted.trial.hypothesis;
    NamedEffect named{.effect = own.effect, .title = own.title(), .alike = {}};
    for (const Hypothesis& other : accepted.alike)
      if (other.effect != own.effect &&
          std::ranges::find(named.alike, other.effect) == named.alike.end())
        named.alike.push_back(other.effect);
    kept.named.push_back(std::move(named));
  }
  const ObservationErrors& errors = diagnosis.found().result.errors.front();
  kept.unit = errors.unit;
  if (errors.held_out.count == 0) return;
  kept.held_out_rms = errors.held_out.rms_distance;
  kept.noise = std::sqrt(errors.unit == "m" ? 3.0 : 2.0) * errors.noise;  // a distance
}

ForeignDiagnosis diagnose_one(const fs::path& folder, const ForeignStudyOptions& options,
                              const fs::path& steps, const ProgressCallback& progress) {
  const auto begin = std::chrono::steady_clock::now();
  ForeignDiagnosis kept;
  DiagnoseOptions diagnosis_options;
  diagnosis_options.fit.seed = options.seed;
  diagnosis_options.fit.threads = options.threads;
  diagnosis_options.budget_s = options.budget_s;
  diagnosis_options.fit.is_cancelled = interrupted;
  try {
    const ObservationKind observations = diagnosis_options.fit.observations;
    const Recording recording =
        complete_recording(read_recording(folder), observations, {}, steps, progress).recording;
    const Diagnosis diagnosis =
        diagnose(read_fit_input(recording, observations), diagnosis_options, progress);
    if (diagnosis.stop == FitStop::cancelled || interrupted()) throw Cancelled();
    if (diagnosis.usable())
      note(diagnosis, kept);
    else
      kept.reason = diagnosis.message;
  } catch (const InputError& error) {
    kept.reason = with_flags(error.what());
  } catch (const NoResult& error) {
    kept.reason = error.what();
  }
  kept.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return kept;
}

/// Names the recording in what is said of its progress.
ProgressCallback of_recording(const std::string& name, const ProgressCallback& progress) {
  return [name, &progress](const Progress& inner) {
    if (interrupted()) return false;
    if (!progress) return true;
    Progress named = inner;
    named.stage = name + ": " + inner.stage;
    return progress(named);
  };
}

}  // namespace

std::vector<fs::path> find_foreign_recordings(const fs::path& folder,
                                              const std::vector<std::string>& only) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError(folder.string(), "is not a folder", "a folder with recordings in it");
  std::vector<fs::path> found;
  for (const FolderEntry& entry : list_whole_folder(folder))
    if (fs::exists(entry.path / kRecordingFile, error) &&
        fs::exists(entry.path / kTruthFile, error))
      found.push_back(entry.path);
  for (const std::string& name : only)
    if (std::ranges::none_of(found, [&](const fs::path& one) { return one.filename() == name; }))
      throw InputError(
          "--only", fmt::format("{} has no recording {}", folder.string(), name),
          fmt::format("a folder there with a {} and a {}", kRecordingFile, kTruthFile));
  if (!only.empty())
    std::erase_if(found, [&](const fs::path& one) {
      return std::ranges::find(only, one.filename().string()) == only.end();
    });
  if (found.empty())
    throw InputError(folder.string(), "holds no recording of which the truth is known",
                     fmt::format("folders with a {} and a {}", kRecordingFile, kTruthFile));
  return found;
}

void ForeignStudyOptions::validate() const {
  require_threads(threads);
  if (!(budget_s >= 0 && budget_s <= 1e9))
    throw InputError("--budget", "is out of range", "0 to 1e9 seconds");
}

std::string ForeignStudyOptions::key() const {
  JournalKey key("study foreign/1");
  key.add("seed", seed).add("budget", budget_s);
  key.add("recordings", fmt::format("{:016x}", recordings_checksum(recordings)));
  return key.line();
}

std::vector<ForeignRow> study_foreign(const ForeignStudyOptions& options, const fs::path& steps,
                                      Journal* journal, const ProgressCallback& progress) {
  options.validate();
  std::vector<ForeignRow> rows;
  for (const fs::path& folder : options.recordings) {
    const auto index = static_cast<int>(rows.size());
    ForeignRow row{.recording = folder.filename().string(), .truth = {}, .diagnosis = {}};
    try {
      const fs::path truth = folder / kTruthFile;
      row.truth = parse_foreign_truth(read_text(truth), truth.string());
    } catch (const InputError& error) {
      row.diagnosis.reason = error.what();
      rows.push_back(std::move(row));
      continue;
    }
    if (journal != nullptr && journal->finished().contains(index)) {
      accept_record(*journal, index, [&](const std::string& payload) {
        row.diagnosis = foreign_diagnosis_of(payload);
      });
    } else {
      if (interrupted()) throw Cancelled();
      row.diagnosis = diagnose_one(folder, options, steps / row.recording,
                                   of_recording(row.recording, progress));
      if (journal != nullptr) journal->append(index, payload_of(row.diagnosis));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace clothfit
