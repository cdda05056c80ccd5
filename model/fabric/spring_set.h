#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "model/fabric/spring_vector.h"

namespace clothfit {

/// Which numbers stand for the springs of a cloth: the set `fabric` (model/fabric/fabric.h), or one
/// of the founding paper's (model/fabric/louchet5.h, louchet18.h).
enum class SpringSet { fabric, louchet5, louchet18 };

std::string to_string(SpringSet set);

/// The set of that name; nothing where there is none.
std::optional<SpringSet> spring_set_named(const std::string& name);

/// What a number of a set is.
enum class SpringQuantity { stiffness, retardation_time, natural_length, critical_elongation };

struct SpringNumber {
  std::string name;
  std::string unit;
  SpringQuantity quantity;
  int type = 0;  ///< of the springs that it stands for, the first of them
};

/// The numbers of a set, in the order of its vector.
std::vector<SpringNumber> numbers_of(SpringSet set);

/// The springs that `numbers`, in that order, stand for; natural lengths that a set does not have
/// are the mesh's.
SpringParameters springs_of(SpringSet set, const Eigen::VectorXd& numbers, const Mesh& mesh);

/// d springs / d numbers, kSpringNumbers x numbers.
Eigen::MatrixXd springs_by_numbers(SpringSet set, const Eigen::VectorXd& numbers);

}  // namespace clothfit
