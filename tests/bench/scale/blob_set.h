// The cache of a simulated worker: which groups of blobs it holds, least recently used ones removed
// first. Not thread-safe.
#pragma once

#include <cstdint>
#include <list>
#include <unordered_map>

namespace color3d {

class BlobSet {
 public:
  explicit BlobSet(int64_t most_bytes) : most_bytes_(most_bytes) {}

  // Returns true if the group is held, which then counts as used.
  bool Use(int64_t group) {
    const auto found = places_.find(group);
    if (found == places_.end()) return false;
    order_.splice(order_.begin(), order_, found->second);
    return true;
  }
  // A group beyond the size of the cache is not held.
  void Add(int64_t group, int64_t bytes) {
    if (bytes > most_bytes_ || Use(group)) return;
    order_.push_front({group, bytes});
    places_[group] = order_.begin();
    bytes_ += bytes;
    while (bytes_ > most_bytes_) {
      bytes_ -= order_.back().bytes;
      places_.erase(order_.back().group);
      order_.pop_back();
    }
  }
  void Clear() {
    order_.clear();
    places_.clear();
    bytes_ = 0;
  }

 private:
  struct Entry {
    int64_t group;
    int64_t bytes;
  };
  int64_t most_bytes_;
  int64_t bytes_ = 0;
  std::list<Entry> order_;  // the last used one first
  std::unordered_map<int64_t, std::list<Entry>::iterator> places_;
};

}  // namespace color3d
