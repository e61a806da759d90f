// Area averaging of a picture that arrives row by row; only the reduced picture is kept in memory.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/base/image.h"

namespace color3d {

// Not thread-safe. Sizes in px; the reduced ones are at least 1 and at most the given ones.
class AreaReducer {
 public:
  AreaReducer(int width, int height, int channels, int reduced_width, int reduced_height)
      : width_(width),
        height_(height),
        channels_(channels),
        reduced_(reduced_width, reduced_height, channels),
        line_(static_cast<size_t>(reduced_width) * channels),
        sum_(line_.size(), 0.0) {}

  // Adds the next row, `width` pixels of interleaved channels; all `height` rows must be added.
  template <typename Sample>
  void AddRow(const Sample* row) {
    ReduceRow(row);
    const double rows =
        static_cast<double>(height_) / reduced_.height;  // source rows per reduced row
    double from = next_row_;
    const double to = ++next_row_;
    while (from < to && filled_ < reduced_.height) {
      const bool last = filled_ + 1 == reduced_.height;
      const double end = last ? to : std::min(to, rows * (filled_ + 1));
      for (size_t i = 0; i < sum_.size(); ++i) sum_[i] += (end - from) * line_[i];
      weight_ += end - from;
      from = end;
      if (last ? next_row_ == height_ : end >= rows * (filled_ + 1)) Flush();
    }
  }

  // Writes channel c as plane c: the averages of the added rows.
  Image Take() { return std::move(reduced_); }

 private:
  template <typename Sample>
  void ReduceRow(const Sample* row) {
    const double columns = static_cast<double>(width_) / reduced_.width;
    for (int x = 0; x < reduced_.width; ++x) {
      const double begin = columns * x, end = x + 1 == reduced_.width ? width_ : columns * (x + 1);
      const int first = static_cast<int>(begin);
      const int last =
          std::min(width_ - 1, static_cast<int>(end));  // covered in part or not at all
      for (int c = 0; c < channels_; ++c) {
        double sum = 0.0;
        for (int i = first + 1; i < last; ++i) sum += row[static_cast<size_t>(i) * channels_ + c];
        if (first == last) {
          sum = (end - begin) * row[static_cast<size_t>(first) * channels_ + c];
        } else {
          sum += (first + 1 - begin) * row[static_cast<size_t>(first) * channels_ + c];
          sum += (end - last) * row[static_cast<size_t>(last) * channels_ + c];
        }
        line_[static_cast<size_t>(x) * channels_ + c] = sum / (end - begin);
      }
    }
  }

  void Flush() {
    for (int x = 0; x < reduced_.width; ++x) {
      for (int c = 0; c < channels_; ++c) {
        double& sum = sum_[static_cast<size_t>(x) * channels_ + c];
        reduced_.At(c, filled_, x) = static_cast<float>(sum / weight_);
        sum = 0.0;
      }
    }
    weight_ = 0.0;
    ++filled_;
  }

  const int width_, height_, channels_;
  Image reduced_;
  std::vector<double> line_;  // the row, reduced in width
  std::vector<double> sum_;   // weighted sum of rows
  double weight_ = 0.0;       // total weight of sum_
  int next_row_ = 0;
  int filled_ = 0;  // completed rows of the reduced picture
};

}  // namespace color3d
