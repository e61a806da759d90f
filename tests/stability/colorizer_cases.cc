// The personalized colorizer on extreme pictures and schedules: results must be finite, and an
// unambiguous key view must be learnt. Errors are the mean CIEDE2000 of the coloured key view to
// its given colours, not relative ones.
#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "tests/stability/stability_case.h"

namespace color3d {
namespace {

constexpr int kSide = 96;
// Bound of the colour error if the key view cannot be learnt in a few iterations.
constexpr double kAnyError = 200.0;

struct Problem {
  Image luminance{kSide, kSide, 1};
  Image ab{kSide, kSide, 2};
  Image weight;
  ColorizerOptions options;
  Image unlike;  // another L to be coloured; empty: the key view's mirrored
  double bound = kAnyError;

  Problem() {
    options.iterations = 30;
    options.max_side_px = kSide;
    options.crop_px = 64;
  }
};

void Fill(Image* image, int channel, float value) {
  std::fill_n(image->Plane(channel), image->PlaneSize(), value);
}

// Smooth blobs and noise.
Image Texture(int width, int height, uint64_t seed) {
  Random random(seed);
  Image l(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      l.At(0, y, x) = static_cast<float>(50.0 + 30.0 * std::sin(0.11 * x) * std::cos(0.07 * y) +
                                         random.NextUniform(-8.0, 8.0));
    }
  }
  return l;
}

Problem Textured() {
  Problem p;
  p.luminance = Texture(kSide, kSide, 1);
  return p;
}

class RestoreCounter : public NullObserver {
 public:
  void OnWarning(const std::string&) override { ++warnings; }
  void OnError(int64_t, const std::string&, double value) override {
    not_finite += std::isfinite(value) ? 0 : 1;
  }
  int64_t warnings = 0;
  int64_t not_finite = 0;
};

StabilityResult Train(const Problem& p) {
  StabilityResult r;
  r.condition_of = "-";
  RestoreCounter observer;
  NoCheckpoints none;
  const CancellationToken go_on;
  const auto encoder = Encoder::Embedded();
  ThreadPool pool(2);
  const auto trained = TrainColorizer(
      encoder, {{"key", p.luminance, p.ab, p.weight}}, p.options, {pool, none, observer, go_on});
  // Colours with the stored and reloaded model.
  const auto colorizer = LoadColorizer(trained->Serialize(), encoder, pool.thread_count());
  const Image key = colorizer->Colorize(p.luminance);
  Image other = p.unlike;
  if (other.Empty()) {
    other = p.luminance;
    std::reverse(other.data.begin(), other.data.end());
  }
  const Image elsewhere = colorizer->Colorize(other);
  r.non_finite = observer.not_finite + CountNonFinite(key.data.data(), key.data.size()) +
                 CountNonFinite(elsewhere.data.data(), elsewhere.data.size());
  r.compared = static_cast<int64_t>(key.data.size() + elsewhere.data.size());
  r.restores = observer.warnings;
  r.value_error = MeanDeltaE00(JoinLab(p.luminance, key), JoinLab(p.luminance, p.ab));
  r.value_bound = p.bound;
  float most = 0.0f;
  for (const float v : elsewhere.data) most = std::max(most, std::abs(v));
  r.held = elsewhere.width == other.width && elsewhere.height == other.height && most <= 200.0f;
  r.outcome = fmt::format(
      "CIEDE2000; largest |ab| elsewhere {}, {} restores", static_cast<int>(most), r.restores);
  return r;
}

// Expects an Error with this code.
StabilityResult Refused(const Problem& p, ErrorCode code) {
  StabilityResult r;
  r.condition_of = "-";
  try {
    Train(p);
    r.held = false;
    r.outcome = "was not refused";
  } catch (const Error& e) {
    r.held = e.code() == code;
    r.outcome = std::string("refused: ") + e.what();
  }
  return r;
}

StabilityResult ConstantImage() {
  Problem p;
  Fill(&p.luminance, 0, 50.0f);
  Fill(&p.ab, 0, 20.0f);
  Fill(&p.ab, 1, -10.0f);
  p.unlike = Texture(kSide, kSide, 2);
  p.bound = 2.0;
  return Train(p);
}

StabilityResult OneColor() {
  Problem p = Textured();
  Fill(&p.ab, 0, 40.0f);
  Fill(&p.ab, 1, 30.0f);
  p.bound = 3.0;
  return Train(p);
}

StabilityResult OneLuminance(float l) {
  Problem p;
  Fill(&p.luminance, 0, l);
  p.unlike = Texture(kSide, kSide, 2);
  p.bound = 1.0;
  return Train(p);
}

StabilityResult SizeOf(int key_width, int key_height, int width, int height) {
  Problem p;
  p.luminance = Texture(key_width, key_height, 3);
  p.ab = Image(key_width, key_height, 2, 25.0f);
  p.unlike = Texture(width, height, 4);
  p.bound = 12.0;
  return Train(p);
}

// Neighbouring pixels at opposite ends of the range of ab.
Problem Extremes(float most) {
  Problem p = Textured();
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      p.ab.At(0, y, x) = (x + y) % 2 == 0 ? most : -most;
      p.ab.At(1, y, x) = (x / 8) % 2 == 0 ? most : -most;
    }
  }
  return p;
}

StabilityResult GamutEdge() {
  Problem p = Textured();
  for (size_t i = 0; i < p.ab.PlaneSize(); ++i) {
    const bool blue = p.luminance.data[i] < 50.0f;
    p.ab.Plane(0)[i] = blue ? 79.0f : -86.0f;   // sRGB blue
    p.ab.Plane(1)[i] = blue ? -108.0f : 83.0f;  // and green
  }
  return Train(p);
}

StabilityResult FastLearning(ColorizerOptions::Recipe recipe, double rate) {
  Problem p = Textured();
  for (size_t i = 0; i < p.ab.PlaneSize(); ++i) p.ab.Plane(0)[i] = p.luminance.data[i] - 50.0f;
  p.options.recipe = recipe;
  p.options.instance_norm = recipe == ColorizerOptions::Recipe::kPaper;
  p.options.learning_rate = rate;
  p.options.iterations = 60;
  return Train(p);
}

StabilityResult NoWeight() {
  Problem p = Textured();
  Fill(&p.ab, 1, 30.0f);
  p.weight = Image(kSide, kSide, 1);
  return Train(p);
}

StabilityResult NotFinite() {
  Problem p = Textured();
  p.ab.At(1, 7, 7) = std::nanf("");
  return Refused(p, ErrorCode::kInvalidArgument);
}

StabilityResult OtherSize() {
  Problem p = Textured();
  p.ab = Image(kSide - 1, kSide, 2);
  return Refused(p, ErrorCode::kInvalidArgument);
}

StabilityCase Case(const std::string& name,
                   const std::function<StabilityResult()>& run,
                   bool slow = false) {
  return {"colorizer", name, slow, [run](ThreadPool&) { return run(); }};
}

}  // namespace

void AddColorizerCases(std::vector<StabilityCase>& cases) {
  using Recipe = ColorizerOptions::Recipe;
  cases.push_back(Case("constant image", ConstantImage));
  cases.push_back(Case("one-colour key view", OneColor));
  cases.push_back(Case("black key view", [] { return OneLuminance(0.0f); }));
  cases.push_back(Case("white key view", [] { return OneLuminance(100.0f); }));
  cases.push_back(
      Case("16x16 key view, 300x200 elsewhere", [] { return SizeOf(16, 16, 300, 200); }));
  cases.push_back(Case("1x1 key view and other picture", [] { return SizeOf(1, 1, 1, 1); }));
  cases.push_back(
      Case("2000x3 key view, 3x2000 elsewhere", [] { return SizeOf(2000, 3, 3, 2000); }));
  cases.push_back(Case(
      "8k key view and other picture", [] { return SizeOf(7680, 4320, 7680, 4320); }, true));
  cases.push_back(Case("colours at the gamut's edge", GamutEdge));
  cases.push_back(Case("ab +-128 from pixel to pixel", [] { return Train(Extremes(128.0f)); }));
  cases.push_back(Case("ab +-1e6 from pixel to pixel",
                       [] { return Refused(Extremes(1e6f), ErrorCode::kInvalidArgument); }));
  cases.push_back(Case("learning rate x100", [] { return FastLearning(Recipe::kColor3d, 0.1); }));
  cases.push_back(Case("learning rate x1000", [] { return FastLearning(Recipe::kColor3d, 1.0); }));
  cases.push_back(Case("paper's recipe, learning rate x100",
                       [] { return FastLearning(Recipe::kPaper, 1e-2); }));
  cases.push_back(Case("all weights zero", NoWeight));
  cases.push_back(Case("a NaN in the key view's colour", NotFinite));
  cases.push_back(Case("colour of another size", OtherSize));
}

}  // namespace color3d
