// A number with its derivatives by kSize variables (forward-mode automatic differentiation), for
// the float64 references: their gradients come from the value's own formulas, not from hand-derived
// ones that could repeat a kernel's mistake. Plain values.
#pragma once

#include <array>
#include <cmath>

namespace color3d {

template <int kSize>
struct Jet {
  double value = 0.0;
  std::array<double, kSize> d{};

  Jet() = default;
  Jet(double constant) : value(constant) {}  // NOLINT: constants mix freely with jets
  static Jet Variable(double value, int index) {
    Jet jet(value);
    jet.d[index] = 1.0;
    return jet;
  }
  // f(value) with f'(value) = slope.
  Jet Mapped(double mapped, double slope) const {
    Jet jet(mapped);
    for (int k = 0; k < kSize; ++k) jet.d[k] = slope * d[k];
    return jet;
  }

  friend Jet operator+(const Jet& a, const Jet& b) {
    return Sum(a, 1.0, b, 1.0, a.value + b.value);
  }
  friend Jet operator-(const Jet& a, const Jet& b) {
    return Sum(a, 1.0, b, -1.0, a.value - b.value);
  }
  friend Jet operator*(const Jet& a, const Jet& b) {
    return Sum(a, b.value, b, a.value, a.value * b.value);
  }
  friend Jet operator/(const Jet& a, const Jet& b) {
    const double quotient = a.value / b.value;
    return Sum(a, 1.0 / b.value, b, -quotient / b.value, quotient);
  }
  friend Jet operator-(const Jet& a) { return a.Mapped(-a.value, -1.0); }

 private:
  static Jet Sum(const Jet& a, double by_a, const Jet& b, double by_b, double value) {
    Jet jet(value);
    for (int k = 0; k < kSize; ++k) jet.d[k] = by_a * a.d[k] + by_b * b.d[k];
    return jet;
  }
};

inline double ValueOf(double x) { return x; }
template <int kSize>
double ValueOf(const Jet<kSize>& x) {
  return x.value;
}

inline double Exp(double x) { return std::exp(x); }
template <int kSize>
Jet<kSize> Exp(const Jet<kSize>& x) {
  const double e = std::exp(x.value);
  return x.Mapped(e, e);
}

inline double SquareRoot(double x) { return std::sqrt(x); }
template <int kSize>
Jet<kSize> SquareRoot(const Jet<kSize>& x) {
  const double root = std::sqrt(x.value);
  return x.Mapped(root, 0.5 / root);
}

// 1 / (1 + exp(-x)) without overflow of the derivative.
inline double Sigmoid(double x) { return 1.0 / (1.0 + std::exp(-x)); }
template <int kSize>
Jet<kSize> Sigmoid(const Jet<kSize>& x) {
  const double s = Sigmoid(x.value);
  return x.Mapped(s, s * Sigmoid(-x.value));
}

// Constant, so without derivative, outside of [low, high].
inline double Limited(double x, double low, double high) {
  return x < low ? low : x > high ? high : x;
}
template <int kSize>
Jet<kSize> Limited(const Jet<kSize>& x, double low, double high) {
  return x.value < low ? Jet<kSize>(low) : x.value > high ? Jet<kSize>(high) : x;
}

}  // namespace color3d
