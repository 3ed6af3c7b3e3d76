/// Kernels of the sweeps, for AVX2.
#include "src/base/avx2_lanes.inl"
#include "src/contact_solver/soft_step/cpu/body_sweep.inl"
#include "src/contact_solver/soft_step/cpu/frame_sweep.inl"
#include "src/contact_solver/soft_step/cpu/manifold_setup.inl"
#include "src/contact_solver/soft_step/cpu/manifold_sweep.inl"
#include "src/contact_solver/soft_step/cpu/sphere_sweep.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

#if defined(JFPX_DOUBLE_PRECISION)
struct Avx2 : Avx2Lanes {
  [[gnu::always_inline]] static void load_quads(const Real* base, std::size_t stride,
                                                const std::uint32_t* items, Vec* columns) {
    Vec rows[4];
    for (int k = 0; k < 4; ++k) rows[k] = _mm256_loadu_pd(base + items[k] * stride);
    transpose(rows, columns);
  }
  [[gnu::always_inline]] static void store_quads(Real* base, std::size_t stride,
                                                 const std::uint32_t* items, const Vec* columns,
                                                 unsigned lanes) {
    Vec rows[4];
    transpose(columns, rows);
    for (int k = 0; k < 4; ++k) {
      if ((lanes >> k & 1) != 0) _mm256_storeu_pd(base + items[k] * stride, rows[k]);
    }
  }
  [[gnu::always_inline]] static Vec load_column(const Real* base, std::size_t stride,
                                                const std::uint32_t* items) {
    return _mm256_set_pd(base[items[3] * stride], base[items[2] * stride], base[items[1] * stride],
                         base[items[0] * stride]);
  }
};
#else
struct Avx2 : Avx2Lanes {
  [[gnu::always_inline]] static void load_quads(const Real* base, std::size_t stride,
                                                const std::uint32_t* items, Vec* columns) {
    Vec rows[4];
    for (int k = 0; k < 4; ++k) {
      rows[k] = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(base + items[k] * stride)),
                                     _mm_loadu_ps(base + items[k + 4] * stride), 1);
    }
    transpose(rows, columns);
  }
  [[gnu::always_inline]] static void store_quads(Real* base, std::size_t stride,
                                                 const std::uint32_t* items, const Vec* columns,
                                                 unsigned lanes) {
    Vec rows[4];
    transpose(columns, rows);
    for (int k = 0; k < 4; ++k) {
      if ((lanes >> k & 1) != 0) {
        _mm_storeu_ps(base + items[k] * stride, _mm256_castps256_ps128(rows[k]));
      }
      if ((lanes >> (k + 4) & 1) != 0) {
        _mm_storeu_ps(base + items[k + 4] * stride, _mm256_extractf128_ps(rows[k], 1));
      }
    }
  }
  [[gnu::always_inline]] static Vec load_column(const Real* base, std::size_t stride,
                                                const std::uint32_t* items) {
    Real values[8];
    for (int k = 0; k < 8; ++k) values[k] = base[items[k] * stride];
    return _mm256_loadu_ps(values);
  }
};
#endif

}  // namespace

constinit const BodySweepKernels kAvx2BodySweep = {
    move_bodies<Avx2>, {accelerate_bodies<Avx2, false>, accelerate_bodies<Avx2, true>}};
constinit const SphereSweepKernels kAvx2SphereSweep = {warm_start<Avx2>,
                                                       {solve<Avx2, false>, solve<Avx2, true>}};
constinit const FrameSweepKernels kAvx2FrameSweep[2] = {frame_kernels<Avx2, false>(),
                                                        frame_kernels<Avx2, true>()};
constinit const BundleFunction kAvx2UnpackManifolds = unpack_manifolds<Avx2>;
constinit const KeepFunction kAvx2KeepManifold = keep_manifold<Avx2>;
constinit const ManifoldSweepKernels kAvx2ManifoldSweep[2] = {
    {complete_manifolds<Avx2, false>,
     warm_start_manifolds<Avx2, false>,
     {solve_manifolds<Avx2, false, false>, solve_manifolds<Avx2, false, true>}},
    {complete_manifolds<Avx2, true>,
     warm_start_manifolds<Avx2, true>,
     {solve_manifolds<Avx2, true, false>, solve_manifolds<Avx2, true, true>}}};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
