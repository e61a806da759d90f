#include "core/image/decode_budget.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/base/memory.h"

namespace color3d {
namespace {

constexpr int64_t kMiB = int64_t{1} << 20;
// Smaller pictures are not counted: measuring the available memory would cost more.
constexpr int64_t kUncountedBytes = 16 * kMiB;
// Share of the available memory; the rest is for other growth.
constexpr double kShare = 0.9;

// Codecs give grey with alpha as four channels.
int64_t CodecChannels(const ImageInfo& info) { return info.channels == 2 ? 4 : info.channels; }

// Turns of the calling thread.
thread_local int turns_held = 0;

}  // namespace

void RequirePictureMemory(const PictureNeed& need, int64_t granted_bytes, const std::string& what) {
  if (need.bytes <= granted_bytes) return;
  const double pixels = static_cast<double>(need.width) * need.height;
  const double fitting = pixels * static_cast<double>(std::max<int64_t>(0, granted_bytes)) /
                         static_cast<double>(need.bytes);
  const double scale = std::sqrt(fitting / pixels);
  throw Error(
      ErrorCode::kResourceExhausted,
      "{} has {} x {} px and takes {} MiB {}, {} MiB are granted; reduce it to {} x {} px or "
      "fewer, or {}",
      need.file_name,
      need.width,
      need.height,
      (need.bytes + kMiB - 1) / kMiB,
      what,
      std::max<int64_t>(0, granted_bytes) / kMiB,
      std::max(1, static_cast<int>(scale * need.width)),
      std::max(1, static_cast<int>(scale * need.height)),
      MemoryRemedy());
}

DecodeBudget& DecodeBudget::OfProcess() {
  static DecodeBudget budget([] { return AvailableMemoryBytes(); });
  return budget;
}

int64_t DecodeBudget::Granted() const {
  return static_cast<int64_t>(kShare * static_cast<double>(available_()));
}

void DecodeBudget::Acquire(const PictureNeed& need) {
  const MutexLock lock(mutex_);
  // Promised memory that is already in use is subtracted twice: this may wait too long but never
  // takes too much.
  while (promised_ > 0 && need.bytes > Granted() - promised_) freed_.Wait(mutex_);
  if (promised_ == 0) RequirePictureMemory(need, Granted(), "while it is decoded");
  promised_ += need.bytes;
}

void DecodeBudget::Release(int64_t bytes) {
  {
    const MutexLock lock(mutex_);
    promised_ -= bytes;
  }
  freed_.NotifyAll();
}

PictureTurn::PictureTurn(const PictureNeed& need, DecodeBudget& budget)
    : budget_(budget), bytes_(turns_held > 0 || need.bytes <= kUncountedBytes ? 0 : need.bytes) {
  if (bytes_ == 0) return;
  budget_.Acquire(need);
  ++turns_held;
}

PictureTurn::~PictureTurn() {
  if (bytes_ == 0) return;
  --turns_held;
  budget_.Release(bytes_);
}

int64_t FloatBytes(const ImageInfo& info, int width, int height) {
  return int64_t{width} * height * CodecChannels(info) * static_cast<int64_t>(sizeof(float));
}

int64_t DecodingBytes(const ImageInfo& info, bool copies) {
  const int64_t samples = int64_t{info.width} * info.height * CodecChannels(info);
  const int64_t stored = samples * (info.bits_per_channel > 8 ? 2 : 1);
  // JPEG files of several scans are held as coefficients of two bytes, WebP and HEIC also as planes
  // of luma and chroma.
  const bool is_held_twice = info.format == ImageFormat::kJpeg ||
                             info.format == ImageFormat::kWebp || info.format == ImageFormat::kHeif;
  const int64_t coefficients = is_held_twice ? 2 * samples : 0;
  const int64_t floats = FloatBytes(info, info.width, info.height);
  return std::max(stored + std::max(coefficients, floats), copies ? 2 * floats : 0);
}

}  // namespace color3d
