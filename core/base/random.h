// Seeded random numbers that give the same sequence on every platform (PCG32, O'Neill 2014).
// Not thread-safe: one generator per thread or per job.
#pragma once

#include <cmath>
#include <cstdint>

namespace color3d {

// Well-mixed bits (SplitMix64, Steele et al. 2014): neighbouring inputs give unrelated outputs.
inline uint64_t MixedBits(uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30u)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27u)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31u);
}

class Random {
 public:
  // The whole state, for checkpoints.
  struct State {
    uint64_t state = 0;
    uint64_t increment = 1;
  };

  explicit Random(uint64_t seed, uint64_t stream = 0) {
    state_.increment = (stream << 1u) | 1u;
    NextUint32();
    state_.state += seed;
    NextUint32();
  }
  explicit Random(const State& state) : state_(state) {}
  const State& state() const { return state_; }

  uint32_t NextUint32() {
    const uint64_t old = state_.state;
    state_.state = old * 6364136223846793005ULL + state_.increment;
    const uint32_t xorshifted = static_cast<uint32_t>(((old >> 18u) ^ old) >> 27u);
    const uint32_t rotation = static_cast<uint32_t>(old >> 59u);
    return (xorshifted >> rotation) | (xorshifted << ((32u - rotation) & 31u));
  }
  // Uniform in [0, bound); bound > 0.
  uint32_t NextBelow(uint32_t bound) {
    return static_cast<uint32_t>((static_cast<uint64_t>(NextUint32()) * bound) >> 32u);
  }
  // Uniform in [0, 1).
  double NextUniform() { return NextUint32() * (1.0 / 4294967296.0); }
  double NextUniform(double low, double high) { return low + (high - low) * NextUniform(); }
  // Standard normal (Box-Muller).
  double NextNormal() {
    const double u = 1.0 - NextUniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(6.283185307179586 * NextUniform());
  }

 private:
  State state_;
};

}  // namespace color3d
