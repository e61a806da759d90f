#include "core/splat/export/splat4d/splat4d.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/bytes/little_endian.h"
#include "core/base/error.h"
#include "core/splat/export/bytes.h"
#include "core/splat/export/morton.h"
#include "core/splat/export/splat4d/held_track.h"
#include "core/splat/export/splat4d/mover_frames.h"
#include "core/splat/export/splat4d/streams.h"

namespace color3d {
namespace {

constexpr char kMagic[] = "SP4D";
constexpr int kVersion = 1;
constexpr int kFramesOfGroup = 30;
constexpr double kStillFramesPerSecond = 30.0;  // for frames without a time span
constexpr double kPositionOfSize = 0.05;        // bound, relative to the median Gaussian's size
constexpr double kFarthestSteps = 1 << 29;
constexpr double kScaleBound = 0.01;  // relative
constexpr int kOpacityBound = 1;      // of 255
// Maximum digits that an offset and a length add to the header.
constexpr size_t kDigitsOfSpan = 40;

Quantizer PositionQuantizer(const ViewerGaussians& g) {
  std::vector<float> sizes = g.log_scale;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  double farthest = 0.0;
  for (const float x : g.position) farthest = std::max(farthest, std::abs(static_cast<double>(x)));
  const double bound = std::max(kPositionOfSize * std::exp(*middle), farthest / kFarthestSteps);
  return {3, bound, 2.0 * bound, bound};
}

Quantizer IntegerQuantizer(int channels, int bound) {
  return {channels, static_cast<double>(bound), 2.0 * bound + 1.0, 1.0};
}

constexpr std::array<const char*, kAttributes> kNames = {"pos", "rot", "rgb", "alpha", "scale"};

// Attributes that may change over time.
constexpr int kTracks = 4;
constexpr std::array<Attribute, kTracks> kTracked = {kPosition, kRotation, kOpacity, kScale};

Quantizer ScaleQuantizer() {
  const double bound = std::log1p(kScaleBound);
  return {3, bound, 2.0 * bound, bound};
}

class Encoder {
 public:
  Encoder(const GaussianModel& model,
          const RgbHarmonics& rgb,
          const ExportFrame& frame,
          int frames,
          ThreadPool& pool)
      : g_(ForViewers(model, rgb, frame, pool)),
        movers_(model, frame, pool),
        begin_s_(model.begin_s()),
        span_s_(model.end_s() - model.begin_s()),
        frames_(frames),
        first_mover_(model.size() - model.MovingCount()),
        tracks_{HeldTrack(PositionQuantizer(g_), model.MovingCount()),
                HeldTrack(IntegerQuantizer(4, 0), model.MovingCount()),
                HeldTrack(IntegerQuantizer(1, kOpacityBound), model.MovingCount()),
                HeldTrack(ScaleQuantizer(), model.MovingCount())} {
    CheckFinite(g_);
  }

  std::string File() {
    Survey();
    Order();
    const std::string still = StaticSection();
    std::vector<std::string> groups;
    for (int first = 0; first < frames_; first += kFramesOfGroup) {
      groups.push_back(Group(first, std::min(first + kFramesOfGroup, frames_)));
    }
    std::string file = Header(still, groups) + still;
    for (const std::string& group : groups) file += group;
    return file;
  }

 private:
  HeldTrack& positions() { return tracks_[0]; }
  HeldTrack& rotations() { return tracks_[1]; }
  HeldTrack& opacities() { return tracks_[2]; }
  HeldTrack& scales() { return tracks_[3]; }

  void GoToFrame(int frame) {
    const double share = frames_ > 1 ? static_cast<double>(frame) / (frames_ - 1) : 0.5;
    movers_.GoTo(begin_s_ + share * span_s_);
  }

  void Survey() {
    ever_seen_.assign(movers_.always.size(), 0);
    for (int frame = 0; frame < frames_; ++frame) {
      GoToFrame(frame);
      positions().Observe(movers_.position, movers_.seen);
      rotations().Observe(movers_.rotation, movers_.seen);
      opacities().Observe(movers_.opacity, movers_.always);
      scales().Observe(movers_.log_scale, movers_.seen);
      for (size_t i = 0; i < ever_seen_.size(); ++i) ever_seen_[i] |= movers_.seen[i];
    }
    for (HeldTrack& track : tracks_) track.Close();
  }

  // A bit for each attribute that changes.
  unsigned Changing(size_t gaussian) const {
    if (gaussian < first_mover_) return 0;
    const size_t i = gaussian - first_mover_;
    return (tracks_[0].IsStill(i) ? 0u : 1u << kPosition) |
           (tracks_[1].IsStill(i) ? 0u : 1u << kRotation) |
           (tracks_[2].IsStill(i) ? 0u : 1u << kOpacity) |
           (tracks_[3].IsStill(i) ? 0u : 1u << kScale);
  }

  // Groups Gaussians that change in the same attributes, and sorts them by spatial neighbourhood.
  void Order() {
    for (const uint32_t i : MortonOrder(LogGridOf(g_.position))) {
      const bool is_seen = i < first_mover_ ? OpacityByte(g_.opacity_logit[i]) > 0
                                            : ever_seen_[i - first_mover_] != 0;
      if (is_seen) order_.push_back(i);
    }
    if (order_.empty()) throw InvalidArgument("no Gaussian of this scene is visible");
    std::stable_sort(order_.begin(), order_.end(), [&](uint32_t x, uint32_t y) {
      return Changing(x) < Changing(y);
    });
  }

  // Moving Gaussians, in the file's order, whose attribute changes.
  std::vector<size_t> MovingGaussians(Attribute attribute) const {
    std::vector<size_t> movers;
    for (const uint32_t i : order_) {
      if ((Changing(i) >> attribute & 1u) != 0) movers.push_back(i - first_mover_);
    }
    return movers;
  }

  Stream StaticMask(Attribute attribute) const {
    Stream stream{attribute, kStatic, std::vector<uint32_t>((order_.size() + 7) / 8, 0)};
    for (size_t n = 0; n < order_.size(); ++n) {
      if ((Changing(order_[n]) >> attribute & 1u) == 0) stream.symbols[n / 8] |= 128u >> (n % 8);
    }
    return stream;
  }

  // Delta coding.
  template <class Steps>
  Stream Differences(Attribute attribute, Steps&& steps) const {
    Stream stream{attribute, kStatic, {}};
    std::array<int32_t, 3> before = {};
    for (const uint32_t i : order_) {
      for (int k = 0; k < 3; ++k) {
        const int32_t now = steps(i, k);
        stream.symbols.push_back(ZigZag(now - before[k]));
        before[k] = now;
      }
    }
    return stream;
  }

  template <class Value>
  Stream Bytes(Attribute attribute, int channels, Value&& value) const {
    Stream stream{attribute, kStatic, {}};
    for (const uint32_t i : order_) {
      for (int k = 0; k < channels; ++k) stream.symbols.push_back(value(i, k));
    }
    return stream;
  }

  std::string StaticSection() {
    const double position_step = positions().quantizer().base_step;
    const int coefficients = ShCoefficients(g_.sh_degree);
    std::vector<Stream> streams;
    for (int a = 0; a < kAttributes; ++a) streams.push_back(StaticMask(static_cast<Attribute>(a)));
    streams.push_back(Differences(kPosition, [&](uint32_t i, int k) {
      if (i >= first_mover_) return positions().Base(i - first_mover_, k);
      return static_cast<int32_t>(std::lround(g_.position[3 * i + k] / position_step));
    }));
    streams.push_back(Differences(kScale, [&](uint32_t i, int k) {
      if (i >= first_mover_) return scales().Base(i - first_mover_, k);
      return static_cast<int32_t>(std::lround(g_.log_scale[3 * i + k] / std::log1p(kScaleBound)));
    }));
    streams.push_back(Bytes(kColor, 3, [&](uint32_t i, int k) {
      return ColorByte(g_.sh[static_cast<size_t>(i) * coefficients * 3 + k]);
    }));
    streams.push_back(Bytes(kOpacity, 1, [&](uint32_t i, int) {
      return i < first_mover_ ? OpacityByte(g_.opacity_logit[i])
                              : static_cast<uint32_t>(opacities().Base(i - first_mover_, 0));
    }));
    streams.push_back(Bytes(kRotation, 4, [&](uint32_t i, int k) {
      return i < first_mover_ ? RotationByte(g_.rotation[4 * i + k])
                              : static_cast<uint32_t>(rotations().Base(i - first_mover_, k) + 128);
    }));
    std::string section;
    for (const Stream& stream : streams) {
      const PackedStream packed = Pack(stream);
      section += packed.head + packed.payload;
    }
    return section;
  }

  std::string Group(int first, int end) {
    std::array<std::vector<size_t>, kTracks> movers;
    std::array<std::vector<int32_t>, kTracks> before;
    std::vector<Stream> keys, deltas;
    for (int a = 0; a < kTracks; ++a) {
      movers[a] = MovingGaussians(kTracked[a]);
      keys.push_back({kTracked[a], kKey, {}});
      deltas.push_back({kTracked[a], kDelta, {}});
    }
    for (int frame = first; frame < end; ++frame) {
      GoToFrame(frame);
      positions().Hold(movers_.position, movers_.seen);
      rotations().Hold(movers_.rotation, movers_.seen);
      opacities().Hold(movers_.opacity, movers_.always);
      scales().Hold(movers_.log_scale, movers_.seen);
      for (int a = 0; a < kTracks; ++a) {
        std::vector<int32_t> held;
        for (const size_t i : movers[a]) {
          for (int k = 0; k < tracks_[a].quantizer().channels; ++k) {
            held.push_back(tracks_[a].Held(i, k));
          }
        }
        Stream& stream = frame == first ? keys[a] : deltas[a];
        for (size_t k = 0; k < held.size(); ++k) {
          stream.symbols.push_back(ZigZag(frame == first ? held[k] : held[k] - before[a][k]));
        }
        before[a] = std::move(held);
      }
    }
    // All keys first: a seeking player shows the key frame before the rest arrives.
    std::string heads, payloads;
    unsigned streams = 0;
    for (const std::vector<Stream>& kind : {keys, deltas}) {
      for (const Stream& stream : kind) {
        if (stream.symbols.empty()) continue;
        const PackedStream packed = Pack(stream);
        heads += packed.head;
        payloads += packed.payload;
        ++streams;
      }
    }
    std::string chunk;
    PutLittleEndian(streams, 2, &chunk);
    return chunk + heads + payloads;
  }

  nlohmann::ordered_json Bounds() const {
    std::array<double, 3> low, high;
    low.fill(HUGE_VAL);
    high.fill(-HUGE_VAL);
    for (const uint32_t i : order_) {
      for (int k = 0; k < 3; ++k) {
        const bool moves = i >= first_mover_;
        const float still = moves ? 0.0f : g_.position[3 * i + k];
        low[k] = std::min<double>(low[k], moves ? tracks_[0].Low(i - first_mover_, k) : still);
        high[k] = std::max<double>(high[k], moves ? tracks_[0].High(i - first_mover_, k) : still);
      }
    }
    return {low[0], low[1], low[2], high[0], high[1], high[2]};
  }

  std::string Header(const std::string& still, const std::vector<std::string>& groups) {
    const double fps =
        frames_ > 1 && span_s_ > 0.0 ? (frames_ - 1) / span_s_ : kStillFramesPerSecond;
    const Quantizer& position = positions().quantizer();
    nlohmann::ordered_json header;
    header["n"] = order_.size();
    header["t"] = frames_;
    header["fps"] = fps;
    header["gop"] = kFramesOfGroup;
    header["bounds"] = {{"pos_m", position.bound},
                        {"scale_rel", kScaleBound},
                        {"rgb", 0},
                        {"alpha", kOpacityBound},
                        {"rot", 0}};
    header["steps"] = {{"pos", position.step},
                       {"base_pos", position.base_step},
                       {"scale_log", 2.0 * std::log1p(kScaleBound)},
                       {"base_scale_log", std::log1p(kScaleBound)},
                       {"rgb", 1},
                       {"alpha", 2 * kOpacityBound + 1},
                       {"rot", 1}};
    for (int a = 0; a < kAttributes; ++a) {
      header["dyn"][kNames[a]] = MovingGaussians(static_cast<Attribute>(a)).size();
    }
    header["groups"] = nlohmann::ordered_json::array();
    for (size_t n = 0, begin = 0; n < order_.size(); begin = n) {
      while (n < order_.size() && Changing(order_[n]) == Changing(order_[begin])) ++n;
      header["groups"].push_back({{"mask", Changing(order_[begin])}, {"count", n - begin}});
    }
    header["aabb"] = Bounds();
    header["denoised"] = false;
    const auto text_from = [&](size_t offset) {
      header["static_section"] = {{"offset", offset}, {"len", still.size()}};
      offset += still.size();
      header["gops"] = nlohmann::ordered_json::array();
      for (size_t n = 0; n < groups.size(); ++n) {
        const int first = static_cast<int>(n) * kFramesOfGroup;
        const int last = std::min(first + kFramesOfGroup, frames_) - 1;
        header["gops"].push_back({{"offset", offset},
                                  {"len", groups[n].size()},
                                  {"f0", first},
                                  {"f1", last},
                                  {"t0", first / fps},
                                  {"t1", last / fps}});
        offset += groups[n].size();
      }
      return header.dump();
    };
    // Offsets count from the start of the file, so blanks keep the header's length.
    const size_t length = text_from(0).size() + kDigitsOfSpan * (groups.size() + 1);
    std::string file = kMagic;
    PutLittleEndian(kVersion, 2, &file);
    PutLittleEndian(0, 2, &file);  // colours are stored unchanged
    PutLittleEndian(length, 4, &file);
    std::string text = text_from(file.size() + length);
    text.resize(length, ' ');
    return file + text;
  }

  ViewerGaussians g_;
  MoverFrames movers_;
  double begin_s_, span_s_;
  int frames_;
  size_t first_mover_;
  std::array<HeldTrack, kTracks> tracks_;  // of kTracked
  std::vector<char> ever_seen_;
  std::vector<uint32_t> order_;
};

}  // namespace

std::string EncodeSplat4d(const GaussianModel& model,
                          const RgbHarmonics& rgb,
                          const ExportFrame& frame,
                          int frames,
                          ThreadPool& pool) {
  if (frames < 1 || frames > kMaxSplat4dFrames) {
    throw InvalidArgument(
        "a .splat4d of {} frames cannot be written; request 1 to {}", frames, kMaxSplat4dFrames);
  }
  if (model.size() == 0) throw InvalidArgument("there are no Gaussians");
  return Encoder(model, rgb, frame, frames, pool).File();
}

}  // namespace color3d
