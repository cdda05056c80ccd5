#include "tests/model/effect_derivatives.h"

#include <sstream>

#include "tests/model/touched_cloth.h"

namespace clothfit {

std::string derivative_mismatch(const EffectMap& map, const Eigen::VectorXd& in,
                                const Eigen::VectorXd& size) {
  const Eigen::MatrixXd stated = map.stated_jacobian(in);
  const double output = map(in).cwiseAbs().maxCoeff();
  for (Eigen::Index n = 0; n < in.size(); ++n) {
    Eigen::VectorXd up = in, down = in;
    up[n] += 1e-5 * size[n];
    down[n] -= 1e-5 * size[n];
    const Eigen::VectorXd seen = (map(up) - map(down)) / (up[n] - down[n]) * size[n];
    const Eigen::VectorXd said = stated.col(n) * size[n];
    Eigen::Index worst = 0;
    const double difference = (seen - said).cwiseAbs().maxCoeff(&worst);
    if (difference <= 1e-6 * seen.cwiseAbs().maxCoeff() + 1e-9 * output) continue;
    std::ostringstream text;
    text << "output " << worst << " by input " << n << " (velocities from " << map.first_velocity()
         << ", forces " << map.first_force() << ", memory " << map.first_memory() << ", parameters "
         << map.first_parameter() << "): stated " << stated(worst, n) << ", differences "
         << seen[worst] / size[n];
    return text.str();
  }
  return "";
}

std::string derivative_mismatch(const Effect& effect, const EffectDescription& description,
                                const std::vector<double>& own, Uniform& uniform) {
  Cloth cloth = touched_cloth(5);
  cloth.held = drifting_points(cloth.mesh);
  const int vertices = cloth.mesh.vertex_count();
  const SpringParameters springs = spring_parameters(cotton(), cloth.mesh);

  for (const EffectDeed deed :
       {EffectDeed::add_force, EffectDeed::change_force, EffectDeed::shift_supports}) {
    if (deed == EffectDeed::change_force && !effect.changes_force()) continue;
    if (deed == EffectDeed::shift_supports && !effect.shifts_supports()) continue;
    const EffectMap map(effect, cloth, static_cast<int>(own.size()), deed);
    Eigen::VectorXd in =
        map.input(crumpled_for(description.name, cloth.mesh, 0.3, uniform),
                  uniform.vectors(vertices, 1), springs, uniform.vectors(1, 9.81), own);
    Eigen::VectorXd size = Eigen::VectorXd::Ones(map.inputs());  // m/s, N
    size.head(3 * vertices).setConstant(cloth.mesh.spacing_s_m());
    size.segment(map.first_memory(), map.first_parameter() - map.first_memory()).setConstant(1e-2);
    for (int n = map.first_force(); n < map.first_parameter(); ++n)
      in[n] = uniform(-size[n], size[n]);
    auto parameters = size.tail(map.inputs() - map.first_parameter());
    for (int type = 0; type < kSpringTypes; ++type) {
      const auto t = static_cast<size_t>(type);
      parameters[ParameterNumber::natural_length(type)] = springs.natural_length_m[t];
      parameters[ParameterNumber::stiffness(type)] = springs.stiffness_n_per_m[t];
      parameters[ParameterNumber::damping(type)] = 1e-2;
    }
    for (size_t p = 0; p < own.size(); ++p)
      parameters[ParameterNumber::own(static_cast<int>(p))] = description.parameters[p].typical;

    const std::string mismatch = derivative_mismatch(map, in, size);
    if (mismatch.empty()) continue;
    constexpr const char* kDeeds[] = {"add_force", "change_force", "shift_supports"};
    return std::string(kDeeds[static_cast<size_t>(deed)]) + ": " + mismatch;
  }
  return "";
}

}  // namespace clothfit
