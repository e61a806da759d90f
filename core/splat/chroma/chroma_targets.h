// Validated target chroma of the training views in the kernels' form. Internal to the splat module.
#pragma once

#include <cstdint>
#include <map>
#include <memory>

#include "core/base/mutex.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/chroma/chroma_fit.h"

namespace color3d {

struct ChromaPlanes {
  PlaneBuffer ab;          // 2 channels: chroma from neutral, range 1 (Lab units / 255)
  PlaneBuffer weight;      // 1 channel, 0..1
  PlaneBuffer confidence;  // 1 channel, 0..1; zeros when unknown
  bool has_confidence = false;
};

// Reads the target of one view. Returns false if it has none. Throws Error{kInvalidArgument} with
// the view and the pixel for a wrong size, chroma that is not finite or weights outside 0..1.
bool LoadChromaPlanes(const ChromaProblem& problem, const PosedCamera& view, ChromaPlanes* planes);

// Cache of targets within a byte budget: the first ones are kept, the others are reread, so that
// memory does not grow with the number of views. Thread-safe if the problem's source is.
class ChromaTargets {
 public:
  // `problem` must outlive this object.
  ChromaTargets(const ChromaProblem& problem, int64_t budget_bytes)
      : problem_(problem), budget_bytes_(budget_bytes) {}

  // Without confidence. Null if the view has no colours. Throws as LoadChromaPlanes.
  std::shared_ptr<const ChromaPlanes> Get(const PosedCamera& view);
  // Stores the planes just read of a view, as far as the budget allows.
  void Offer(const PosedCamera& view, ChromaPlanes planes);
  int64_t kept_bytes() const;

 private:
  const ChromaProblem& problem_;
  const int64_t budget_bytes_;
  mutable Mutex mutex_;
  int64_t kept_bytes_ COLOR3D_GUARDED_BY(mutex_) = 0;
  std::map<int, std::shared_ptr<const ChromaPlanes>> kept_ COLOR3D_GUARDED_BY(mutex_);  // by view
};

}  // namespace color3d
