#include "tests/bench/bullet_patch.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include <algorithm>

namespace clothfit {

struct BulletPatch::Parts {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSoftBodyWorldInfo world;
  std::unique_ptr<btSoftBody> body;
};

BulletPatch::BulletPatch(int vertices_per_side) : parts_(std::make_unique<Parts>()) {
  Parts& parts = *parts_;
  parts.world.m_dispatcher = &parts.dispatcher;
  parts.world.m_broadphase = &parts.broadphase;
  parts.world.m_gravity.setValue(0, static_cast<btScalar>(-9.81), 0);
  parts.world.m_sparsesdf.Initialize();
  const auto size_m = static_cast<btScalar>(0.4);
  constexpr int kFirstTwoCorners = 1 + 2;
  parts.body.reset(btSoftBodyHelpers::CreatePatch(
      parts.world, btVector3(0, 0, 0), btVector3(size_m, 0, 0), btVector3(0, 0, size_m),
      btVector3(size_m, 0, size_m), vertices_per_side, vertices_per_side, kFirstTwoCorners, true));
  parts.body->generateBendingConstraints(2);
  parts.body->setTotalMass(static_cast<btScalar>(0.025));
  parts.body->m_cfg.piterations = 1;
  parts.body->m_cfg.collisions = 0;
}

BulletPatch::~BulletPatch() = default;

int BulletPatch::link_count() const {
  return parts_->body->m_links.size();
}

void BulletPatch::step(double time_step_s) {
  parts_->body->predictMotion(static_cast<btScalar>(time_step_s));
  parts_->body->solveConstraints();
  parts_->body->integrateMotion();
}

double BulletPatch::lowest_m() const {
  double lowest = 0;
  for (int n = 0; n < parts_->body->m_nodes.size(); ++n)
    lowest = std::min(lowest, static_cast<double>(parts_->body->m_nodes[n].m_x.y()));
  return lowest;
}

}  // namespace clothfit
