/// Pair tests of src/collide on the device: they compile with nvcc, and give the same bits as on
/// the host.
#include <jfpx/random.hpp>
#include <jfpx/thesis/intersect.hpp>

#include "src/collide/bounding_sphere.hpp"
#include "src/collide/box_pair.hpp"
#include "src/collide/shapes.hpp"
#include "src/collide/sphere_pair.hpp"
#include "src/scene/inertia.hpp"
#include "tests/collide/pair_tests.hpp"

#include <cuda_runtime.h>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

struct Input {
  SphereInstance first, second;
  Box box_a, box_b;
  Transform pose_a, pose_b;
  HalfSpace half_space;
  Plane plane;
};

/// Results of all pair tests.
struct Output {
  PairResult spheres;
  Touch sphere_box, sphere_half_space, sphere_plane;
  Manifold box_half_space, box_plane, boxes;
  std::uint32_t may_touch = 0;
  SphereInstance enclosing;
  Mat3 inertia;
};

JFPX_HD Output test_all(const Input& in) {
  Output out;
  out.spheres = detail::test_sphere_pair(in.first, in.second);
  out.sphere_box = collide(in.first, in.box_a, in.pose_a);
  out.sphere_half_space = collide(in.first, in.half_space);
  out.sphere_plane = collide(in.first, in.plane);
  out.box_half_space = collide(in.box_a, in.pose_a, in.half_space);
  out.box_plane = collide(in.box_a, in.pose_a, in.plane);
  out.boxes = detail::collide_boxes(in.box_a, in.pose_a, in.box_b, in.pose_b);
  const bool may[] = {may_touch(in.first, in.half_space),
                      may_touch(in.first, in.plane),
                      may_touch(in.first, in.box_a, in.pose_a),
                      may_touch(in.box_a, in.pose_a, in.half_space),
                      may_touch(in.box_a, in.pose_a, in.plane),
                      may_touch(in.box_a, in.pose_a, in.box_b, in.pose_b)};
  for (int i = 0; i < 6; ++i) out.may_touch |= (may[i] ? 1u : 0u) << i;
  out.enclosing = detail::enclosing(in.first, in.second);
  out.inertia =
      detail::in_world_axes(diagonal(detail::moments_of_inertia(in.box_a, 2)), in.pose_a.basis) +
      detail::parallel_axis(in.pose_a.origin, 2);
  return out;
}

__global__ void test_all_kernel(const Input* inputs, Output* outputs, int count) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < count) outputs[i] = test_all(inputs[i]);
}

Transform random_pose(Random* random, const Vec3& origin) {
  const Quat q{random->uniform(-1, 1), random->uniform(-1, 1), random->uniform(-1, 1),
               random->uniform(-1, 1)};
  return make_transform(normalized(q), origin);
}

Input random_input(Random* random) {
  const Vec3 low{-2, -2, -2}, high{2, 2, 2};
  Input in;
  in.first = {random->uniform_in_box(low, high), random->uniform(Real(0.1), 2)};
  in.second = {random->uniform_in_box(low, high), random->uniform(Real(0.1), 2)};
  in.box_a.half_extents = random->uniform_in_box({Real(0.01), Real(0.1), Real(0.1)}, {1, 1, 2});
  in.box_b.half_extents = random->uniform_in_box({Real(0.01), Real(0.1), Real(0.1)}, {1, 1, 2});
  in.pose_a = random_pose(random, random->uniform_in_box(low, high));
  in.pose_b = random_pose(random, random->uniform_in_box(low, high));
  if (random->below(4) == 0) in.pose_b.basis = in.pose_a.basis;
  in.half_space = {random_pose(random, {}).basis.column(0), random->uniform(-1, 1)};
  in.plane = {in.half_space.normal, in.half_space.offset};
  return in;
}

bool same(const Output& a, const Output& b) {
  return a.spheres == b.spheres && a.sphere_box == b.sphere_box &&
         a.sphere_half_space == b.sphere_half_space && a.sphere_plane == b.sphere_plane &&
         a.box_half_space == b.box_half_space && a.box_plane == b.box_plane && a.boxes == b.boxes &&
         a.may_touch == b.may_touch && a.enclosing == b.enclosing && a.inertia == b.inertia;
}

}  // namespace

PairTestRun run_pair_tests(std::uint64_t seed, int count) {
  PairTestRun run;
  Random random(seed);
  std::vector<Input> inputs;
  for (int i = 0; i < count; ++i) inputs.push_back(random_input(&random));
  std::vector<Output> outputs(inputs.size());
  Input* d_inputs = nullptr;
  Output* d_outputs = nullptr;
  const auto attempt = [&run](cudaError_t result) {
    if (result != cudaSuccess && run.failure.empty()) run.failure = cudaGetErrorName(result);
    return result == cudaSuccess;
  };
  const std::size_t input_bytes = inputs.size() * sizeof(Input);
  const std::size_t output_bytes = outputs.size() * sizeof(Output);
  if (attempt(cudaMalloc(&d_inputs, input_bytes)) &&
      attempt(cudaMalloc(&d_outputs, output_bytes)) &&
      attempt(cudaMemcpy(d_inputs, inputs.data(), input_bytes, cudaMemcpyHostToDevice))) {
    test_all_kernel<<<(count + 127) / 128, 128>>>(d_inputs, d_outputs, count);
    attempt(cudaGetLastError());
    attempt(cudaMemcpy(outputs.data(), d_outputs, output_bytes, cudaMemcpyDeviceToHost));
  }
  cudaFree(d_inputs);
  cudaFree(d_outputs);
  if (!run.failure.empty()) return run;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const Output expected = test_all(inputs[i]);
    if (!same(outputs[i], expected)) ++run.differences;
    if (expected.boxes.count > 0) ++run.touching_boxes;
  }
  return run;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
