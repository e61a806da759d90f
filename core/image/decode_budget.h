// Pictures are decoded within the memory that the process may take, as many at once as fit.
// Thread-safe.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include "core/image/probe/probe.h"

namespace color3d {

// A picture and the memory that a piece of work on it takes at its peak.
struct PictureNeed {
  std::string file_name;
  int width = 0;  // px
  int height = 0;
  int64_t bytes = 0;
};

// Throws Error{kResourceExhausted} when `need` is more than `granted_bytes`. The message names the
// file, its size in px, what it takes and what is granted in MiB, and what to do. `what` completes
// "takes N MiB ...", e.g. "while it is decoded".
void RequirePictureMemory(const PictureNeed& need, int64_t granted_bytes, const std::string& what);

// Memory that is promised to pictures.
class DecodeBudget {
 public:
  // `available`: bytes that may be taken at the moment; called with every large picture.
  explicit DecodeBudget(std::function<int64_t()> available) : available_(std::move(available)) {}
  // Of AvailableMemoryBytes.
  static DecodeBudget& OfProcess();

  // Waits until `need` fits beside what other threads were promised. Throws as RequirePictureMemory
  // when it does not fit alone.
  void Acquire(const PictureNeed& need);
  void Release(int64_t bytes);

 private:
  int64_t Granted() const;

  const std::function<int64_t()> available_;
  std::mutex mutex_;
  std::condition_variable freed_;
  int64_t promised_ = 0;
};

// Holds a picture's memory from the budget while it lives. Small pictures are not counted. A thread
// that holds one already is covered by it: work that decodes a picture and goes on with it at full
// size takes one turn for the whole. Not to be handed to another thread.
class PictureTurn {
 public:
  // Throws as DecodeBudget::Acquire.
  explicit PictureTurn(const PictureNeed& need, DecodeBudget& budget = DecodeBudget::OfProcess());
  ~PictureTurn();
  PictureTurn(const PictureTurn&) = delete;
  PictureTurn& operator=(const PictureTurn&) = delete;

 private:
  DecodeBudget& budget_;
  const int64_t bytes_;  // 0: nothing is held
};

// Bytes of the floats that a codec's picture becomes when it has this size, all its channels.
int64_t FloatBytes(const ImageInfo& info, int width, int height);
// Bytes of DecodeImage's picture and of all that decoding takes beside it, at the peak. `copies`:
// channels are left out or the picture is turned, for which it is there twice.
int64_t DecodingBytes(const ImageInfo& info, bool copies);

}  // namespace color3d
