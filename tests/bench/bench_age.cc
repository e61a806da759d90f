// color3d-bench age: makes scans of old prints from a capture. Camera positions stay true, but
// intrinsics do not: crops and scales differ.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/image/crop.h"
#include "core/scene/photos.h"
#include "tests/bench/commands.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxCrop = 0.08;  // of each side
constexpr double kMinScale = 0.5;
constexpr double kMinGamma = 0.7, kMaxGamma = 1.4;
constexpr double kMaxFade = 0.12;   // of black and of white
constexpr double kGrain = 0.03;     // standard deviation
constexpr double kMinPaper = 0.02;  // border over the longer side
constexpr double kMaxPaper = 0.05;
constexpr int kSpecks = 60, kScratches = 4;
constexpr float kSepia[3] = {1.0f, 0.86f, 0.66f};  // of white, at full strength
constexpr float kPaper[3] = {0.93f, 0.9f, 0.84f};

Image CropAndScale(const Image& photo, Random* random) {
  const auto cut = [&](int length) {
    return static_cast<int>(random->NextUniform(0.0, kMaxCrop) * length);
  };
  const int left = cut(photo.width), right = cut(photo.width);
  const int top = cut(photo.height), bottom = cut(photo.height);
  const Image part =
      Crop(photo, left, top, photo.width - left - right, photo.height - top - bottom);
  const double scale = random->NextUniform(kMinScale, 1.0);
  return Resize(part,
                std::max(1, static_cast<int>(std::lround(scale * part.width))),
                std::max(1, static_cast<int>(std::lround(scale * part.height))));
}

void AddSpecksAndScratches(Image* gray, Random* random) {
  const auto blot = [&](int x, int y, int radius, float value) {
    for (int dy = -radius; dy <= radius; ++dy) {
      for (int dx = -radius; dx <= radius; ++dx) {
        const int px = x + dx, py = y + dy;
        if (dx * dx + dy * dy > radius * radius || px < 0 || py < 0 || px >= gray->width ||
            py >= gray->height) {
          continue;
        }
        gray->At(0, py, px) = value;
      }
    }
  };
  for (int i = 0; i < kSpecks; ++i) {
    blot(static_cast<int>(random->NextBelow(gray->width)),
         static_cast<int>(random->NextBelow(gray->height)),
         static_cast<int>(random->NextBelow(3)),
         random->NextBelow(3) == 0 ? 0.1f : 0.95f);
  }
  for (int i = 0; i < kScratches; ++i) {
    const double slope = random->NextUniform(-0.15, 0.15);
    const double from = random->NextUniform(0.0, gray->width);
    const int begin = static_cast<int>(random->NextBelow(gray->height));
    const int end = std::min(gray->height, begin + gray->height / 3);
    for (int y = begin; y < end; ++y) {
      blot(static_cast<int>(from + slope * (y - begin)), y, 0, 0.95f);
    }
  }
}

// sRGB of a faded sepia print on its paper.
Image PrintOf(const Image& photo, Random* random) {
  Image gray = CropAndScale(LuminanceFromSrgb(photo), random);
  const double gamma = random->NextUniform(kMinGamma, kMaxGamma);
  const double black = random->NextUniform(0.0, kMaxFade);
  const double white = 1.0 - random->NextUniform(0.0, kMaxFade);
  for (float& value : gray.data) {
    const double tone = std::pow(GrayFromLuminance(value), gamma);
    const double faded = black + (white - black) * tone + kGrain * random->NextNormal();
    value = static_cast<float>(std::clamp(faded, 0.0, 1.0));
  }
  AddSpecksAndScratches(&gray, random);
  const auto strength = static_cast<float>(random->NextUniform(0.2, 1.0));
  const int paper = static_cast<int>(random->NextUniform(kMinPaper, kMaxPaper) *
                                     std::max(gray.width, gray.height));
  Image print(gray.width + 2 * paper, gray.height + 2 * paper, 3);
  for (int c = 0; c < 3; ++c) {
    std::fill_n(print.Plane(c), print.PlaneSize(), kPaper[c]);
    const float tint = 1.0f + strength * (kSepia[c] - 1.0f);
    for (int y = 0; y < gray.height; ++y) {
      for (int x = 0; x < gray.width; ++x) {
        print.At(c, y + paper, x + paper) = tint * gray.At(0, y, x);
      }
    }
  }
  return print;
}

struct AgeArguments {
  std::string scene_folder;
  std::string out_folder;
  uint64_t seed = 1;
};

void RunAge(const AgeArguments& args) {
  const fs::path from = args.scene_folder, to = args.out_folder;
  const std::vector<Photo> photos = ListPhotos(from);
  if (photos.empty()) throw InvalidArgument("{} holds no photos", from.string());
  for (size_t i = 0; i < photos.size(); ++i) {
    Random random(args.seed, i);
    const fs::path file = to / photos[i].file;
    fs::create_directories(file.parent_path());
    const Image print = PrintOf(ReadImage(from / photos[i].file), &random);
    const std::string extension = file.extension();
    WriteFileAtomic(file,
                    extension == ".png" ? EncodePng8(print) : EncodeJpeg(print, /*quality=*/85));
  }
}

}  // namespace

void AddAgeCommand(CLI::App& app) {
  auto args = std::make_shared<AgeArguments>();
  CLI::App* command = app.add_subcommand(
      "age", "Make scans of old prints from a capture: sepia, borders, dust, crops, other scales");
  command->add_option("--scene", args->scene_folder, "Folder with images/")->required();
  command->add_option("--out", args->out_folder, "Folder for the prints")->required();
  command->add_option("--seed", args->seed, "Seed of all random choices");
  command->callback([args] { RunAge(*args); });
}

}  // namespace color3d
