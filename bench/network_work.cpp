#include "network_work.hpp"

namespace vnreg::bench {
namespace {

double as_double(detail::Index value) { return static_cast<double>(value); }

/// Multiply-adds per vector component of a block [v; m] -> out, v of `half` channels: U0 and S on v
/// alone, F0 on both halves, U1, F1. `u0`, `u1`: rows of the directions.
struct BlockShape {
  double half, out, u0, u1;
  double directions_and_hidden() const { return u0 * half + out * 2 * half + u1 * out; }
  double outer() const { return out * out + out * half; }
  double whole() const { return directions_and_hidden() + outer(); }
};

BlockShape block_shape(double half, double out, bool shared) {
  return {half, out, shared ? 1 : 2 * half, shared ? 1 : out};
}

}  // namespace

double paper_flops_per_point(const detail::Architecture& arch) {
  const double c = as_double(arch.channels_global), l = as_double(arch.channels_local);
  const double d = as_double(arch.channels_descriptor);
  const double s0 = as_double(arch.channels_significance[0]);
  const double s1 = as_double(arch.channels_significance[1]);
  const bool shared = arch.shared_direction;
  const BlockShape encoder = block_shape(c, c, shared);
  const double first = 3 * (2 * c + encoder.u0 + c) + c * 2 * c + encoder.u1 * c + c * c;
  const double last = encoder.directions_and_hidden();  // its outer products follow the mean
  const double network2 = block_shape(c, l, shared).whole() + block_shape(l, l, shared).whole();
  const double invariant = (l / 2 * l + l / 4 * l / 2) * (shared ? 1 : 2) + 3 * l / 4;
  const double per_component = first + 3 * encoder.whole() + last + network2 + invariant;
  const double plain = 3 * 3 * l + d * 3 * l + s0 * d + s1 * s0 + s1;
  return 2 * (3 * per_component + plain);
}

double vnreg_flops(const detail::DescriptorArchitecture& arch, double encoded,
                   const NeighbourhoodPairs& pairs) {
  const double c = as_double(arch.vectors), h = as_double(arch.scalars);
  const double k = as_double(arch.gates), p = as_double(arch.products);
  const double local_blocks = as_double(arch.local_blocks);
  const double context_blocks = as_double(arch.context_blocks);
  const double block = 3 * 2 * c * c, collect = k * h + 3 * c * (k + c);
  const double own_products = 2 * 3 * p * c;  // the partners, then the products with them
  const double frames = 3 * as_double(arch.frames) * c;
  const double point = 18 * h + 3 * 21 * c + c * h + block + own_products + (c * p + h) * h;
  const double local = collect + local_blocks * block + own_products + (c * p + 2 * h) * h + h * h +
                       as_double(arch.local_descriptor) * h + frames;
  const double context = 3 * 8 * c + collect + context_blocks * block + own_products + 3 * p * c +
                         (2 * c * p + 2 * h) * h + h * h + as_double(arch.context_descriptor) * h +
                         frames + 3 * h;
  const double message = 4 * k + 3 * c + h;
  return 2 * encoded * (point + local + context) + 40 * pairs.moments +
         2 * message * (pairs.local + pairs.context);
}

}  // namespace vnreg::bench
