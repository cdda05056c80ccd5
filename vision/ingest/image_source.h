#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "data/finding.h"
#include "vision/ingest/footage_watch.h"

namespace clothfit {

/// Gives pictures of one size in order, as 8-bit grey with 0 black and 255 white, from a folder or
/// a video file. Pixels stand as the sensor reads them out: turns that metadata ask for are not
/// applied, as the camera file describes the sensor.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  ImageSource() = default;
  ImageSource(const ImageSource&) = delete;
  ImageSource& operator=(const ImageSource&) = delete;

  /// Reads the next picture into `grey`; false after the last one. One whose file is damaged is
  /// given too, with `damage` set and `grey` not to be used. Throws InputError for one that differs
  /// in size from the first, and for interlaced pictures.
  bool next(cv::Mat& grey);
  /// Returns the frame of the picture last returned. It rises from 0, and skips frames that have no
  /// picture.
  int frame() const;
  /// Returns the file name, or "picture N" of a video, of the picture last returned.
  virtual std::string current_name() const = 0;
  /// Says what is wrong with the file of the picture last returned; empty where it is whole.
  virtual std::string damage() const { return ""; }
  /// Says whether the picture last returned is nearly black.
  bool dark() const { return watch_.dark(); }
  /// Returns the number of pictures.
  virtual int count() const = 0;
  /// Returns the time of each picture (s) as the container states it; empty where there is none.
  virtual std::vector<double> times_s() const { return {}; }
  /// Returns the number of each picture by which names count them, in steps of one; empty where
  /// none does.
  virtual std::vector<std::int64_t> name_numbers() const { return {}; }
  /// Returns what has been noticed so far, warnings and notes.
  Findings findings() const;

  /// Gives pictures other frames than those they have of themselves: that of picture n is
  /// `frame_of_picture`[n], rising.
  void number_frames(std::vector<int> frame_of_picture);

 protected:
  /// Does the work of `next`. `grey` may stay empty where `damage` is not.
  virtual bool read_next(cv::Mat& grey) = 0;
  /// Returns the number of the picture last returned, counted with those that are missing.
  virtual int own_number() const = 0;
  /// Returns the place of the picture last returned among those there are.
  virtual int picture_index() const { return own_number(); }
  /// Returns what the files themselves say.
  virtual Findings own_findings() const { return {}; }
  /// Returns the file or folder, as refusals name it.
  virtual std::string where() const = 0;

 private:
  FootageWatch watch_;
  cv::Size size_;
  std::vector<int> frame_of_picture_;
};

}  // namespace clothfit
