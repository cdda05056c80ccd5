#pragma once

#include <string>

namespace clothfit {

/// Names what rounds the C library's functions, as "glibc 2.36 rounding 36ae0ff7". The second word
/// sums up some thousand values: it differs between processors with and without fused
/// multiply-add. All else gives the same bits on every processor (docs/conventions.md). Two runs by
/// one version of the program therefore agree to the bit where this is the same.
std::string arithmetic_name();

}  // namespace clothfit
