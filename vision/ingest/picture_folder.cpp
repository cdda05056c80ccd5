#include "vision/ingest/picture_folder.h"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "data/folder_entries.h"
#include "data/input_error.h"
#include "vision/ingest/decode_picture.h"
#include "vision/ingest/frame_list.h"
#include "vision/ingest/picture_content.h"
#include "vision/ingest/picture_names.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// Leaves out pictures that lie beside others of their names in formats that are read: raw ones
/// that a camera writes along.
void leave_out_companions(std::vector<fs::path>& files) {
  std::set<std::string> read;
  for (const fs::path& file : files)
    if (has_picture_name(file)) read.insert(file.stem().string());
  std::erase_if(files, [&](const fs::path& file) {
    return has_foreign_picture_name(file) && read.contains(file.stem().string());
  });
}

/// Names tell the pictures of a folder; where none does, the content of the files. What is named as
/// a picture, or leads to no file at all, is never passed over: the frames after it would shift.
std::vector<fs::path> pictures_in(const fs::path& folder) {
  std::vector<fs::path> named, others;
  for (const FolderEntry& entry : list_folder(folder)) {
    const bool picture = has_picture_name(entry.path) || has_foreign_picture_name(entry.path);
    const bool file = entry.kind == FolderEntry::Kind::file;
    if (entry.kind == FolderEntry::Kind::other || (picture && !file))
      refuse_entry(entry, "a picture file");
    if (file) (picture ? named : others).push_back(entry.path);
  }
  if (named.empty())
    std::ranges::copy_if(others, std::back_inserter(named), [](const fs::path& file) {
      const PictureContent::Kind kind = content_of_file(file).kind;
      return kind == PictureContent::Kind::picture || kind == PictureContent::Kind::foreign;
    });
  if (named.empty())
    throw InputError(folder.string(), "the folder holds no picture",
                     fmt::format("{} files", kReadFormats),
                     "name the folder that holds the frames themselves");
  leave_out_companions(named);
  return named;
}

/// Returns the brightest level of a picture.
int brightest(const cv::Mat& levels) {
  double level = 0;
  cv::minMaxLoc(levels, nullptr, &level);
  return static_cast<int>(level);
}

/// Returns how many bits hold levels up to this one, of those that cameras have.
int bits_for(int level) {
  for (const int bits : {8, 10, 12, 14})
    if (level < 1 << bits) return bits;
  return 16;
}

class PictureFolder : public ImageSource {
 public:
  PictureFolder(const fs::path& folder, NumberedPictures pictures)
      : folder_(folder), pictures_(std::move(pictures)) {}

  std::string current_name() const override {
    return next_ == 0 ? std::string() : current().filename().string();
  }
  std::string damage() const override { return damage_; }
  int count() const override { return static_cast<int>(pictures_.files.size()); }

 protected:
  bool read_next(cv::Mat& grey) override {
    if (next_ == pictures_.files.size()) return false;
    DecodedPicture picture = decode_picture(pictures_.files[next_++]);
    damage_ = picture.damage;
    if (!damage_.empty()) {
      damaged_.push_back(frame());
      last_damaged_ = fmt::format("{}: {}", current_name(), damage_);
      if (2 * damaged_.size() > pictures_.files.size())
        throw InputError(
            current().string(),
            fmt::format(
                "the picture cannot be decoded ({}){}", damage_,
                damaged_.size() > 1 ? fmt::format(", nor can {} more", damaged_.size() - 1) : ""),
            "whole pictures", "copy them again or remove them");
      return true;
    }
    note_turn(picture);
    if (picture.grey.depth() == CV_8U)
      grey = std::move(picture.grey);
    else
      to_8_bits(picture, grey);
    return true;
  }

  int own_number() const override { return next_ == 0 ? -1 : pictures_.frames[next_ - 1]; }
  int picture_index() const override { return static_cast<int>(next_) - 1; }
  std::vector<std::int64_t> name_numbers() const override { return pictures_.numbers; }
  std::string where() const override { return folder_.string(); }

  Findings own_findings() const override {
    Findings findings = pictures_.findings;
    if (!damaged_.empty())
      findings.push_back(
          {.check = "pictures",
           .state = FindingState::warning,
           .found = fmt::format("{} of {} pictures are damaged and left out: frames {} ({})",
                                damaged_.size(), count(), list_numbers(damaged_), last_damaged_),
           .where = where(),
           .expected = "whole files",
           .remedy = "copy them again"});
    if (!turn_.empty())
      findings.push_back({.check = "pictures", .found = turn_, .where = "", .expected = ""});
    if (bits_ > 0)
      findings.push_back(
          {.check = "pictures",
           .found = fmt::format("levels of {} bits, stored in 16, are read as such", bits_)});
    return findings;
  }

 private:
  const fs::path& current() const { return pictures_.files[next_ - 1]; }

  /// Says once that a turn is not applied.
  void note_turn(const DecodedPicture& picture) {
    if (!turn_.empty() || (picture.turn_deg == 0 && !picture.flipped)) return;
    turn_ = fmt::format(
        "{} asks viewers to turn it by {} degrees clockwise{}; pixels are used as the sensor read "
        "them",
        current_name(), picture.turn_deg, picture.flipped ? " and to mirror it" : "");
  }

  /// Brings levels of more bits to 8, by the bits that the folder's pictures use: sensors of 10 to
  /// 14 bits write files of 16.
  void to_8_bits(const DecodedPicture& picture, cv::Mat& grey) {
    if (bits_ == 0) bits_ = picture.bits < 16 || picture.white_stated ? picture.bits : bits_used();
    const int level = brightest(picture.grey);
    if (level >= 1 << bits_)
      throw InputError(
          current().string(),
          fmt::format("its levels reach {}, those of others only {} bits", level, bits_),
          "pictures of one range", "give all of them the same number of bits");
    picture.grey.convertTo(grey, CV_8U, 255.0 / ((1 << bits_) - 1));
  }

  /// Returns the bits that the folder's pictures use. All are looked at until one uses 16: the
  /// brightest may be any.
  int bits_used() const {
    int level = 0;
    for (const fs::path& file : pictures_.files) {
      const DecodedPicture one = decode_picture(file);
      if (one.damage.empty() && one.bits == 16) level = std::max(level, brightest(one.grey));
      if (bits_for(level) == 16) break;
    }
    return bits_for(level);
  }

  fs::path folder_;
  NumberedPictures pictures_;
  size_t next_ = 0;
  int bits_ = 0;  ///< used of 16; 0 before the first such picture
  std::string damage_;
  std::vector<int> damaged_;
  std::string last_damaged_;  ///< name and reason
  std::string turn_;
};

}  // namespace

std::unique_ptr<ImageSource> open_picture_folder(const fs::path& folder) {
  return std::make_unique<PictureFolder>(folder, number_pictures(pictures_in(folder)));
}

std::unique_ptr<ImageSource> open_picture(const fs::path& file) {
  return std::make_unique<PictureFolder>(file.parent_path(), number_pictures({file}));
}

}  // namespace clothfit
