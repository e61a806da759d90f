// Decides which live pictures may be with the inference worker together, so that a picture that
// kills it is identified. Not thread-safe.
#pragma once

#include <deque>
#include <set>
#include <string>

namespace color3d {

using LivePicture = std::string;  // digest of the whole request to the worker

class PoisonWatch {
 public:
  // No picture is remembered as suspect or poison.
  bool IsEmpty() const { return suspects_.empty() && poison_.empty(); }
  // The picture was alone with a worker that died.
  bool IsPoison(const LivePicture& picture) const { return poison_.contains(picture); }
  // The picture was with others at a worker that died: it must be sent alone now.
  bool IsSuspect(const LivePicture& picture) const { return suspects_.contains(picture); }

  // Returns whether the picture may be sent now. A suspect waits until no other is pending, and the
  // others wait for it.
  bool MaySend(const LivePicture& picture) const;
  void OnSent(const LivePicture& picture);
  enum class End { kAnswered, kWorkerDied, kUnknown };  // kUnknown: cancelled, timed out
  void OnEnd(const LivePicture& picture, End end);

 private:
  static constexpr size_t kMostRemembered = 10'000;
  // Adds a picture; forgets the oldest one beyond the limit.
  void Remember(const LivePicture& picture, std::set<LivePicture>* names);

  int under_way_ = 0;
  bool alone_ = false;
  std::set<LivePicture> suspects_, poison_;
  std::deque<LivePicture> oldest_first_;
};

}  // namespace color3d
