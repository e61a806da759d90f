#include "server/rpc/live/poison_watch.h"

namespace color3d {

bool PoisonWatch::MaySend(const LivePicture& picture) const {
  return IsSuspect(picture) ? under_way_ == 0 : !alone_;
}

void PoisonWatch::OnSent(const LivePicture& picture) {
  alone_ = IsSuspect(picture);
  ++under_way_;
}

void PoisonWatch::OnEnd(const LivePicture& picture, End end) {
  const bool was_alone = alone_;
  if (--under_way_ == 0) alone_ = false;
  if (end == End::kAnswered) suspects_.erase(picture);
  if (end == End::kWorkerDied) Remember(picture, was_alone ? &poison_ : &suspects_);
}

void PoisonWatch::Remember(const LivePicture& picture, std::set<LivePicture>* names) {
  if (names->insert(picture).second) oldest_first_.push_back(picture);
  if (oldest_first_.size() <= kMostRemembered) return;
  suspects_.erase(oldest_first_.front());
  poison_.erase(oldest_first_.front());
  oldest_first_.pop_front();
}

}  // namespace color3d
