/// Steps of bodies that fall onto a terrain, in stock Bullet and with the three classes of jfpx, in
/// turn. Times are CPU time of the thread with one thread, else wall clock. A ratio is the median
/// over the steps of jfpx / stock, so a value below 1 means that jfpx is faster.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/bullet/dynamics_world.hpp>
#include <jfpx/bullet/verify.hpp>
#include <jfpx/random.hpp>

#include "bench/bullet/series.hpp"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr int kBodies = 3000;
constexpr int kCells = 100;

enum class Terrain { mesh, fine_mesh, heights };

btScalar height_at(btScalar x, btScalar z) {
  return static_cast<btScalar>(2 * std::sin(0.21 * x) * std::cos(0.17 * z) +
                               0.6 * std::sin(0.9 * x + 0.3 * z));
}

/// A terrain of 100 x 100 units and bodies above it, in a world of Bullet's or of jfpx's classes.
class TerrainWorld {
 public:
  /// @param threads 0: stock Bullet
  TerrainWorld(Terrain terrain, bool boxes, unsigned threads) {
    if (threads == 0) {
      dispatcher_ = std::make_unique<btCollisionDispatcher>(&configuration_);
      solver_ = std::make_unique<btSequentialImpulseConstraintSolver>();
      world_ = std::make_unique<btDiscreteDynamicsWorld>(dispatcher_.get(), &broadphase_,
                                                         solver_.get(), &configuration_);
    } else {
      dispatcher_ = std::make_unique<CollisionDispatcher>(
          &configuration_,
          DispatcherOptions{.collider = {.backend = Backend::cpu, .threads = threads}});
      solver_ = std::make_unique<ConstraintSolver>(
          ConstraintSolverOptions{.backend = Backend::cpu, .threads = threads});
      world_ = std::make_unique<DynamicsWorld>(dispatcher_.get(), &broadphase_, solver_.get(),
                                               &configuration_,
                                               DynamicsWorldOptions{.threads = threads});
    }
    terrain == Terrain::heights ? make_heights() : make_mesh(terrain == Terrain::mesh ? 1 : 3);
    add(terrain_.get(), 0, btVector3(0, 0, 0));
    Random random(11);
    constexpr int kSide = 32;
    for (int i = 0; i < kBodies; ++i) {
      const int place = i % (kSide * kSide), layer = i / (kSide * kSide);
      const btScalar spacing = btScalar(0.85) * kCells / kSide;
      const btVector3 position(btScalar(place % kSide - kSide / 2) * spacing,
                               btScalar(5 + 2 * layer) + random.uniform(0, Real(0.5)),
                               btScalar(place / kSide - kSide / 2) * spacing);
      btCollisionShape* shape = &sphere_;
      if (boxes && i % 2 != 0) shape = &box_;
      btRigidBody* body = add(shape, 1, position);
      body->setFriction(btScalar(0.6));
      body->setRollingFriction(btScalar(0.02));
      body->setActivationState(DISABLE_DEACTIVATION);
    }
  }
  ~TerrainWorld() {
    for (const auto& body : bodies_) world_->removeRigidBody(body.get());
  }
  TerrainWorld(const TerrainWorld&) = delete;
  TerrainWorld& operator=(const TerrainWorld&) = delete;

  void step() { world_->stepSimulation(btScalar(1) / 60, 0); }
  btDiscreteDynamicsWorld& world() { return *world_; }

 private:
  btRigidBody* add(btCollisionShape* shape, btScalar mass, const btVector3& position) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
    info.m_startWorldTransform.setOrigin(position);
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    world_->addRigidBody(bodies_.back().get());
    return bodies_.back().get();
  }
  void make_heights() {
    for (int z = 0; z <= kCells; ++z) {
      for (int x = 0; x <= kCells; ++x) {
        points_.push_back(height_at(btScalar(x - kCells / 2), btScalar(z - kCells / 2)));
      }
    }
    terrain_ = std::make_unique<btHeightfieldTerrainShape>(
        kCells + 1, kCells + 1, points_.data(), 1, -4, 4, 1,
        sizeof(btScalar) == 8 ? PHY_DOUBLE : PHY_FLOAT, false);
  }
  void make_mesh(int cells_per_unit) {
    const int cells = kCells * cells_per_unit;
    for (int z = 0; z <= cells; ++z) {
      for (int x = 0; x <= cells; ++x) {
        const btScalar px = btScalar(x - cells / 2) / btScalar(cells_per_unit);
        const btScalar pz = btScalar(z - cells / 2) / btScalar(cells_per_unit);
        points_.insert(points_.end(), {px, height_at(px, pz), pz});
        if (x == cells || z == cells) continue;
        const int a = z * (cells + 1) + x, b = a + cells + 1;
        indices_.insert(indices_.end(), {a, b, a + 1, a + 1, b, b + 1});
      }
    }
    arrays_ = std::make_unique<btTriangleIndexVertexArray>(
        static_cast<int>(indices_.size() / 3), indices_.data(), static_cast<int>(3 * sizeof(int)),
        static_cast<int>(points_.size() / 3), points_.data(),
        static_cast<int>(3 * sizeof(btScalar)));
    terrain_ = std::make_unique<btBvhTriangleMeshShape>(arrays_.get(), true);
  }

  std::vector<btScalar> points_;
  std::vector<int> indices_;
  std::unique_ptr<btTriangleIndexVertexArray> arrays_;
  std::unique_ptr<btConcaveShape> terrain_;
  btSphereShape sphere_{btScalar(0.4)};
  btBoxShape box_{btVector3(btScalar(0.4), btScalar(0.3), btScalar(0.5))};
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  btDefaultCollisionConfiguration configuration_;
  btDbvtBroadphase broadphase_;
  std::unique_ptr<btCollisionDispatcher> dispatcher_;
  std::unique_ptr<btConstraintSolver> solver_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
};

/// Without profile zones: Bullet enters two for each triangle, so that measuring them would add
/// more to its time than to that of jfpx.
void step_on_terrain(benchmark::State& state, Terrain terrain, bool boxes) {
  TerrainWorld stock(terrain, boxes, 0);
  TerrainWorld ours(terrain, boxes, static_cast<unsigned>(state.range(0)));
  compare_steps(state, &stock, &ours);
}

void register_all() {
  const auto add = [](const char* name, Terrain terrain, bool boxes) {
    benchmark::RegisterBenchmark(
        name, [=](benchmark::State& state) { step_on_terrain(state, terrain, boxes); })
        ->ArgName("threads")
        ->Arg(1)
        ->Arg(2)
        ->Arg(16)
        ->Iterations(240)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  };
  add("mesh_20k/spheres", Terrain::mesh, false);
  add("mesh_180k/spheres", Terrain::fine_mesh, false);
  add("heights/spheres", Terrain::heights, false);
  add("heights/spheres_and_boxes", Terrain::heights, true);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  return jfpx::bullet::run_benchmarks(argc, argv, jfpx::bullet::register_all);
}
