#include "tests/support/formats/splat4d_reader.h"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace color3d {
namespace {

constexpr std::array<int, 5> kChannels = {3, 4, 3, 1, 3};
constexpr std::array<const char*, 5> kSteps = {"pos", "rot", "rgb", "alpha", "scale_log"};

void Require(bool good, const std::string& complaint) {
  if (!good) throw std::runtime_error(complaint);
}

class Bytes {
 public:
  explicit Bytes(std::string_view bytes) : left_(bytes) {}
  std::string_view Take(size_t count) {
    Require(count <= left_.size(), "the file ends early");
    const std::string_view taken = left_.substr(0, count);
    left_.remove_prefix(count);
    return taken;
  }
  uint32_t Number(int width) {
    const std::string_view bytes = Take(width);
    uint32_t value = 0;
    for (int k = width - 1; k >= 0; --k) value = value << 8u | static_cast<uint8_t>(bytes[k]);
    return value;
  }
  bool empty() const { return left_.empty(); }

 private:
  std::string_view left_;
};

struct Head {
  int attribute = 0;
  int kind = 0;
  int width = 0;
  size_t count = 0;
  size_t packed = 0;
};

Head ReadHead(Bytes& bytes) {
  Head head;
  head.attribute = static_cast<int>(bytes.Number(1));
  head.kind = static_cast<int>(bytes.Number(1));
  head.width = static_cast<int>(bytes.Number(1));
  head.count = bytes.Number(4);
  head.packed = bytes.Number(4);
  Require(head.attribute < 5 && head.kind < 3, "unknown stream");
  return head;
}

std::vector<uint32_t> ReadSymbols(const Head& head, Bytes& bytes) {
  const std::string_view packed = bytes.Take(head.packed);
  std::string planes(head.count * head.width, '\0');
  Require(
      ZSTD_decompress(planes.data(), planes.size(), packed.data(), packed.size()) == planes.size(),
      "a stream of another length");
  std::vector<uint32_t> symbols(head.count, 0);
  for (int byte = 0; byte < head.width; ++byte) {
    for (size_t i = 0; i < head.count; ++i) {
      symbols[i] |= static_cast<uint32_t>(static_cast<uint8_t>(planes[byte * head.count + i]))
                    << (8 * byte);
    }
  }
  return symbols;
}

std::vector<uint32_t> ReadStream(int attribute, size_t count, Bytes& bytes) {
  const Head head = ReadHead(bytes);
  Require(head.attribute == attribute && head.kind == 2 && head.count == count, "another stream");
  return ReadSymbols(head, bytes);
}

int UnZigZag(uint32_t symbol) {
  return static_cast<int>(symbol >> 1u) ^ -static_cast<int>(symbol & 1u);
}

std::vector<int> Sums(const std::vector<uint32_t>& symbols) {
  std::vector<int> sums;
  for (size_t i = 0; i < symbols.size(); ++i) {
    sums.push_back(UnZigZag(symbols[i]) + (i >= 3 ? sums[i - 3] : 0));
  }
  return sums;
}

}  // namespace

Splat4dFile ReadSplat4d(std::string_view bytes) {
  Bytes start(bytes);
  Require(start.Take(4) == "SP4D" && start.Number(2) == 1 && start.Number(2) == 0, "no .splat4d");
  const size_t header_bytes = start.Number(4);
  const auto header = nlohmann::json::parse(start.Take(header_bytes));
  const auto& steps = header["steps"];
  const size_t n = header["n"];
  size_t next = 12 + header_bytes;
  const auto section = [&](const nlohmann::json& span) {
    Require(span["offset"] == next, "sections that leave a gap");
    const size_t length = span["len"];
    Require(next + length <= bytes.size(), "the file ends early");
    next += length;
    return Bytes(bytes.substr(next - length, length));
  };

  Bytes still = section(header["static_section"]);
  std::array<std::vector<size_t>, 5> changing;
  for (int a = 0; a < 5; ++a) {
    const std::vector<uint32_t> mask = ReadStream(a, (n + 7) / 8, still);
    for (size_t i = 0; i < n; ++i) {
      if ((mask[i / 8] & 128u >> (i % 8)) == 0) changing[a].push_back(i);
    }
  }
  Splat4dFrame frame;
  for (const int p : Sums(ReadStream(0, 3 * n, still))) {
    frame.position.push_back(p * steps["base_pos"].get<double>());
  }
  for (const int s : Sums(ReadStream(4, 3 * n, still))) {
    frame.log_scale.push_back(s * steps["base_scale_log"].get<double>());
  }
  for (const uint32_t c : ReadStream(2, 3 * n, still)) frame.color.push_back(static_cast<int>(c));
  for (const uint32_t o : ReadStream(3, n, still)) frame.opacity.push_back(static_cast<int>(o));
  for (const uint32_t r : ReadStream(1, 4 * n, still)) {
    frame.rotation.push_back(static_cast<int>(r) - 128);
  }
  Require(still.empty(), "bytes after the static section");

  Splat4dFile file;
  file.frames_per_second = header["fps"];
  file.position_bound = header["bounds"]["pos_m"];
  file.moving = changing[0].size();
  file.box = header["aabb"].get<std::vector<double>>();
  std::array<std::vector<int>, 5> now;
  for (const auto& span : header["gops"]) {
    Bytes group = section(span);
    std::vector<Head> heads(group.Number(2));
    for (Head& head : heads) head = ReadHead(group);
    std::array<std::vector<uint32_t>, 5> keys, deltas;
    for (const Head& head : heads) {
      (head.kind == 0 ? keys : deltas)[head.attribute] = ReadSymbols(head, group);
    }
    Require(group.empty(), "bytes after a group");
    const int first = span["f0"], last = span["f1"];
    Require(first == static_cast<int>(file.frames.size()), "frames that leave a gap");
    for (int f = first; f <= last; ++f) {
      for (int a = 0; a < 5; ++a) {
        const size_t numbers = changing[a].size() * kChannels[a];
        Require(keys[a].size() == numbers, "a key frame of another size");
        Require(deltas[a].size() == numbers * (last - first), "differences of another size");
        now[a].resize(numbers);
        for (size_t i = 0; i < numbers; ++i) {
          now[a][i] = f == first ? UnZigZag(keys[a][i])
                                 : now[a][i] + UnZigZag(deltas[a][(f - first - 1) * numbers + i]);
          const size_t at = changing[a][i / kChannels[a]] * kChannels[a] + i % kChannels[a];
          const double value = now[a][i] * steps[kSteps[a]].get<double>();
          const int whole = static_cast<int>(value);
          if (a == 0) frame.position[at] = value;
          if (a == 1) frame.rotation[at] = whole;
          if (a == 2) frame.color[at] = std::clamp(whole, 0, 255);
          if (a == 3) frame.opacity[at] = std::clamp(whole, 0, 255);
          if (a == 4) frame.log_scale[at] = value;
        }
      }
      file.frames.push_back(frame);
    }
  }
  Require(next == bytes.size(), "bytes after the last section");
  Require(file.frames.size() == header["t"], "another number of frames");
  return file;
}

}  // namespace color3d
