// Which live pictures may be with the inference worker together, so that one that kills it is found
// out. Not thread-safe.
#pragma once

#include <deque>
#include <set>
#include <string>

namespace color3d {

using LivePicture = std::string;  // digest of all that the worker is sent

class PoisonWatch {
 public:
  // No worker has died with a picture that is remembered.
  bool IsEmpty() const { return suspects_.empty() && poison_.empty(); }
  // It was alone with a worker that died.
  bool IsPoison(const LivePicture& picture) const { return poison_.contains(picture); }
  // It was with a worker that died, with others: it must be alone now.
  bool IsSuspect(const LivePicture& picture) const { return suspects_.contains(picture); }

  // Whether it may be sent now. A suspect waits for all others to be answered, and they for it.
  bool MaySend(const LivePicture& picture) const;
  void OnSent(const LivePicture& picture);
  enum class End { kAnswered, kWorkerDied, kUnknown };  // unknown: cancelled, too late
  void OnEnd(const LivePicture& picture, End end);

 private:
  static constexpr size_t kMostRemembered = 10'000;
  // The oldest is forgotten.
  void Remember(const LivePicture& picture, std::set<LivePicture>* names);

  int under_way_ = 0;
  bool alone_ = false;
  std::set<LivePicture> suspects_, poison_;
  std::deque<LivePicture> oldest_first_;
};

}  // namespace color3d
