#pragma once

#include <opencv2/core.hpp>
#include <set>
#include <string>

namespace clothfit {

/// Says, as a remedy, how a picture would show the listed tags: mirrored, or with black and white
/// exchanged. Empty where it would not. An empty list stands for all tags of the family.
std::string turned_picture_shows(const cv::Mat& grey, const std::string& family,
                                 const std::set<int>& listed);

/// Says, as a remedy, what footage shows that shows none of the listed tags. `grey` is its first
/// picture, `unlisted` are the tags of that family in any of its pictures.
std::string what_appears_instead(const cv::Mat& grey, const std::string& family,
                                 const std::set<int>& listed, const std::set<int>& unlisted);

}  // namespace clothfit
