#include "core/colorizer/scene_batch.h"

#include <algorithm>
#include <thread>
#include <tuple>

namespace color3d {
namespace {

// Interval at which a waiting scene checks for cancellation.
constexpr auto kCancelPoll = std::chrono::milliseconds(50);

// A session fills two: one trains while the other prepares the next sample.
constexpr int kMaxSlotsOfTurn = 2;

int CoresIfZero(int slots) {
  if (slots > 0) return slots;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace

SceneBatch::SceneBatch(int slots) : slots_(CoresIfZero(slots)), free_slots_(slots_) {}

int SceneBatch::size() const {
  const MutexLock lock(mutex_);
  return static_cast<int>(members_.size());
}

std::shared_ptr<const Encoder> SceneBatch::SharedEncoder(
    const std::string& name, const std::function<std::shared_ptr<const Encoder>()>& load) {
  const MutexLock lock(encoder_mutex_);
  std::shared_ptr<const Encoder> encoder = encoders_[name].lock();
  if (!encoder) {
    encoder = load();
    encoders_[name] = encoder;
  }
  return encoder;
}

const SceneBatch::Member* SceneBatch::Next() const {
  const Member* next = nullptr;
  const auto key = [this](const Member& member) COLOR3D_REQUIRES(mutex_) {
    return std::make_tuple(project_seconds_.at(member.project), member.seconds);
  };
  for (const Member& member : members_) {
    if (member.waiting && (next == nullptr || key(member) < key(*next))) next = &member;
  }
  return next;
}

SceneBatch::Membership::Membership(SceneBatch& batch, const std::string& project) : batch_(batch) {
  const MutexLock lock(batch_.mutex_);
  Member member;
  member.project = project;
  // New members start at the least time of the others, so that they neither make up for the time
  // before they joined nor wait longer than the others.
  bool first = true;
  for (const Member& other : batch_.members_) {
    if (other.project != project) continue;
    member.seconds = first ? other.seconds : std::min(member.seconds, other.seconds);
    first = false;
  }
  if (!batch_.project_seconds_.contains(project)) {
    double min_seconds = 0.0;
    for (auto it = batch_.project_seconds_.begin(); it != batch_.project_seconds_.end(); ++it) {
      min_seconds =
          it == batch_.project_seconds_.begin() ? it->second : std::min(min_seconds, it->second);
    }
    batch_.project_seconds_[project] = min_seconds;
  }
  member_ = batch_.members_.insert(batch_.members_.end(), member);
}

SceneBatch::Membership::~Membership() {
  const MutexLock lock(batch_.mutex_);
  const std::string project = member_->project;
  batch_.members_.erase(member_);
  const bool last = std::none_of(batch_.members_.begin(),
                                 batch_.members_.end(),
                                 [&](const Member& member) { return member.project == project; });
  if (last) batch_.project_seconds_.erase(project);
  batch_.changed_.NotifyAll();
}

SceneBatch::Turn::Turn(Membership& membership, const CancellationToken& cancel)
    : membership_(membership) {
  SceneBatch& batch = membership.batch_;
  const MutexLock lock(batch.mutex_);
  Member& member = *membership.member_;
  member.waiting = true;
  while (batch.free_slots_ == 0 || batch.Next() != &member) {
    if (cancel.IsCancelled()) {
      member.waiting = false;
      batch.changed_.NotifyAll();
      cancel.ThrowIfCancelled();
    }
    batch.changed_.WaitFor(batch.mutex_, kCancelPoll);
  }
  member.waiting = false;
  slots_ = batch.Next() == nullptr ? std::min(batch.free_slots_, kMaxSlotsOfTurn) : 1;
  batch.free_slots_ -= slots_;
  batch.changed_.NotifyAll();
  start_ = std::chrono::steady_clock::now();
}

SceneBatch::Turn::~Turn() {
  SceneBatch& batch = membership_.batch_;
  const double seconds =
      slots_ * std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const MutexLock lock(batch.mutex_);
  batch.free_slots_ += slots_;
  membership_.member_->seconds += seconds;
  batch.project_seconds_[membership_.member_->project] += seconds;
  batch.changed_.NotifyAll();
}

}  // namespace color3d
