// A resource of the simulation: equal servers that serve requests in the order of their arrival.
// Not thread-safe.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace color3d {

class FifoResource {
 public:
  // `servers`: 0 means any number.
  FifoResource(std::string name, int servers)
      : name_(std::move(name)), free_at_(static_cast<size_t>(servers), 0.0) {}

  // Returns when a request that arrives now is done; one without work does not wait. Requires:
  // `now` does not decrease.
  double Serve(double now, double seconds) {
    needed_ += seconds;
    return ServeBeside(now, seconds);
  }
  // The same for a request that may come less often when the resource is full: a heartbeat.
  double ServeBeside(double now, double seconds) {
    busy_ += seconds;
    if (free_at_.empty() || seconds <= 0.0) return now + seconds;
    const auto first = std::min_element(free_at_.begin(), free_at_.end());
    *first = std::max(*first, now) + seconds;
    return *first;
  }
  // Notes that a worker waited for this resource.
  void AddWait(double seconds) { waited_ += seconds; }

  const std::string& name() const { return name_; }
  bool IsLimited() const { return !free_at_.empty(); }
  double waited() const { return waited_; }
  // Shares of the capacity that were used until `end`; work that lasts longer counts as well.
  double Share(double end) const { return ShareOf(busy_, end); }
  // Without heartbeats.
  double NeededShare(double end) const { return ShareOf(needed_, end); }

 private:
  double ShareOf(double seconds, double end) const {
    if (free_at_.empty() || end <= 0.0) return 0.0;
    return std::min(1.0, seconds / (end * static_cast<double>(free_at_.size())));
  }

  std::string name_;
  std::vector<double> free_at_;
  double busy_ = 0.0;
  double needed_ = 0.0;
  double waited_ = 0.0;
};

}  // namespace color3d
