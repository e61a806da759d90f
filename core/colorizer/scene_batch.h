// Training of many scenes at once (STILL.md "All-in-one"): each scene trains on a thread of its
// own, with its own options, checkpoints, clock and cancellation. The scenes share one frozen
// encoder and take turns at the compute slots. A turn goes to the project with the least computing
// time, and within it to the scene with the least. Scenes join and leave at any time, and fail
// alone. The results of a scene are the same, byte for byte, alone and in a batch. Thread-safe.
//
// Measured on 2 cores against stacking scenes on the batch axis: an encoder pass over stacked crops
// and grouped convolutions over stacked decoders were no faster than a call for each scene.
#pragma once

#include <chrono>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>

#include "core/base/cancellation.h"
#include "core/base/mutex.h"
#include "core/encoder/encoder.h"

namespace color3d {

class SceneBatch {
 public:
  // `slots`: maximum number of scenes that compute at once; 0: number of cores.
  explicit SceneBatch(int slots = 0);

  int slots() const { return slots_; }
  // Number of scenes in the batch now.
  int size() const;

  // The encoder of this name: the one in memory, else the result of `load`.
  std::shared_ptr<const Encoder> SharedEncoder(
      const std::string& name, const std::function<std::shared_ptr<const Encoder>()>& load);

 private:
  struct Member {
    std::string project;
    double seconds = 0.0;  // of slots, since it joined
    bool waiting = false;
  };

 public:
  // A scene's membership, from construction to destruction. Used by one thread.
  class Membership {
   public:
    // `project`: of the scene's owner. All scenes of a project share its turns.
    Membership(SceneBatch& batch, const std::string& project);
    ~Membership();
    Membership(const Membership&) = delete;
    Membership& operator=(const Membership&) = delete;

   private:
    friend class SceneBatch;
    SceneBatch& batch_;
    std::list<Member>::iterator member_;
  };

  // The right to compute, from construction to destruction. The constructor waits until it is the
  // membership's turn and throws Error{kCancelled} when `cancel` comes first.
  class Turn {
   public:
    Turn(Membership& membership, const CancellationToken& cancel);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    // Slots that this turn may fill: more than one only if no other member waits.
    int slots() const { return slots_; }

   private:
    Membership& membership_;
    int slots_ = 1;
    std::chrono::steady_clock::time_point start_;
  };

 private:
  // The member whose turn is next, or null if none waits.
  const Member* Next() const COLOR3D_REQUIRES(mutex_);

  const int slots_;
  mutable Mutex mutex_;
  CondVar changed_;
  int free_slots_ COLOR3D_GUARDED_BY(mutex_);
  std::list<Member> members_ COLOR3D_GUARDED_BY(mutex_);
  std::map<std::string, double> project_seconds_
      COLOR3D_GUARDED_BY(mutex_);  // of projects with members
  Mutex encoder_mutex_;
  std::map<std::string, std::weak_ptr<const Encoder>> encoders_ COLOR3D_GUARDED_BY(encoder_mutex_);
};

// The place of a scene that trains in a batch.
struct BatchPlace {
  SceneBatch& batch;
  std::string project;  // unit of fairness, e.g. the submitted job
};

}  // namespace color3d
