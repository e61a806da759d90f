// Limits concurrent decoding of pictures to the memory available to the process. Thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/base/mutex.h"
#include "core/image/probe/probe.h"

namespace color3d {

// A picture and the peak memory of an operation on it.
struct PictureNeed {
  std::string file_name;
  int width = 0;  // px
  int height = 0;
  int64_t bytes = 0;
};

// Throws Error{kResourceExhausted} if `need` exceeds `granted_bytes`. The message names the file,
// its size in px, the memory needed and granted in MiB, and the remedy. `what` completes "takes N
// MiB ...", e.g. "while it is decoded".
void RequirePictureMemory(const PictureNeed& need, int64_t granted_bytes, const std::string& what);

// Memory reserved for pictures.
class DecodeBudget {
 public:
  // `available`: returns the bytes available now; called for every large picture.
  explicit DecodeBudget(std::function<int64_t()> available) : available_(std::move(available)) {}
  // Uses AvailableMemoryBytes.
  static DecodeBudget& OfProcess();

  // Waits until `need` fits beside the reservations of other threads. Throws as
  // RequirePictureMemory if it does not fit alone.
  void Acquire(const PictureNeed& need);
  void Release(int64_t bytes);

 private:
  int64_t Granted() const;

  const std::function<int64_t()> available_;
  Mutex mutex_;
  CondVar freed_;
  int64_t promised_ COLOR3D_GUARDED_BY(mutex_) = 0;
};

// Reserves a picture's memory during its lifetime. Small pictures are not counted. Nested
// reservations of one thread are free: work that decodes a picture and continues at full size
// reserves once for the whole. Must not be passed to another thread.
class PictureTurn {
 public:
  // Throws as DecodeBudget::Acquire.
  explicit PictureTurn(const PictureNeed& need, DecodeBudget& budget = DecodeBudget::OfProcess());
  ~PictureTurn();
  PictureTurn(const PictureTurn&) = delete;
  PictureTurn& operator=(const PictureTurn&) = delete;

 private:
  DecodeBudget& budget_;
  const int64_t bytes_;  // 0: no reservation
};

// Size in bytes of the float image of this size with all channels.
int64_t FloatBytes(const ImageInfo& info, int width, int height);
// Peak memory in bytes of decoding with DecodeImage, including its result. `copies`: channels are
// dropped or the picture is rotated, which needs a second copy.
int64_t DecodingBytes(const ImageInfo& info, bool copies);

}  // namespace color3d
