#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "model/fabric/spring_vector.h"

namespace clothfit {

/// Says which numbers stand for the springs of a cloth. They are the set `fabric`
/// (model/fabric/fabric.h), or one of the founding paper's (model/fabric/louchet5.h, louchet18.h).
enum class SpringSet { fabric, louchet5, louchet18 };

std::string to_string(SpringSet set);

/// Returns the set of that name; nothing where there is none.
std::optional<SpringSet> spring_set_named(const std::string& name);

/// The quantity that a number of a set stands for.
enum class SpringQuantity { stiffness, retardation_time, natural_length, critical_elongation };

struct SpringNumber {
  std::string name;
  std::string unit;
  SpringQuantity quantity;
  int type = 0;  ///< first type of the springs that it stands for
};

/// Returns the numbers of a set, in the order of its vector.
std::vector<SpringNumber> numbers_of(SpringSet set);

/// Returns the springs that `numbers`, in that order, stand for. Natural lengths that a set does
/// not have are the mesh's.
SpringParameters springs_of(SpringSet set, const Eigen::VectorXd& numbers, const Mesh& mesh);

/// Returns d springs / d numbers, kSpringNumbers x numbers.
Eigen::MatrixXd springs_by_numbers(SpringSet set, const Eigen::VectorXd& numbers);

}  // namespace clothfit
