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
    busy_ += seconds;
    if (free_at_.empty() || seconds <= 0.0) return now + seconds;
    const auto first = std::min_element(free_at_.begin(), free_at_.end());
    *first = std::max(*first, now) + seconds;
    return *first;
  }

  const std::string& name() const { return name_; }
  bool IsLimited() const { return !free_at_.empty(); }
  // Share of the capacity that was used until `end`; work that lasts longer counts as well.
  double Share(double end) const {
    if (free_at_.empty() || end <= 0.0) return 0.0;
    return std::min(1.0, busy_ / (end * static_cast<double>(free_at_.size())));
  }

 private:
  std::string name_;
  std::vector<double> free_at_;
  double busy_ = 0.0;
};

}  // namespace color3d
