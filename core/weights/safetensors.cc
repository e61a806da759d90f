#include "core/weights/safetensors.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "core/weights/element_type.h"

namespace color3d {
namespace {

constexpr uint64_t kMaxHeaderBytes = 100'000'000;
constexpr uint64_t kLengthBytes = 8;

std::optional<ElementType> TypeFromName(std::string_view name) {
  static constexpr std::pair<std::string_view, ElementType> kTypes[] = {
      {"F32", ElementType::kFloat32},
      {"F16", ElementType::kFloat16},
      {"BF16", ElementType::kBfloat16},
      {"F64", ElementType::kFloat64},
      {"I8", ElementType::kInt8},
      {"U8", ElementType::kUint8},
      {"I16", ElementType::kInt16},
      {"U16", ElementType::kUint16},
      {"I32", ElementType::kInt32},
      {"U32", ElementType::kUint32},
      {"I64", ElementType::kInt64},
      {"U64", ElementType::kUint64},
      {"BOOL", ElementType::kBool}};
  for (const auto& [text, type] : kTypes) {
    if (text == name) return type;
  }
  return std::nullopt;
}

struct Entry {
  std::string name;
  std::optional<ElementType> type;
  std::optional<std::vector<int64_t>> shape;
  std::vector<uint64_t> offsets;
};

// Parses the header as events, since a JSON tree can take a hundred times the memory of the text.
// Refuses anything outside the format at once.
class HeaderHandler : public nlohmann::json::json_sax_t {
 public:
  HeaderHandler(const ByteSource& source, WeightMetadata* metadata)
      : source_(source), metadata_(metadata) {}

  std::vector<Entry> TakeEntries() { return std::move(entries_); }

  bool start_object(std::size_t) override {
    if (place_ == Place::kStart) {
      place_ = Place::kTop;
    } else if (place_ == Place::kTop && key_ == "__metadata__") {
      place_ = Place::kMetadata;
    } else if (place_ == Place::kTop) {
      entries_.push_back({key_, {}, {}, {}});
      place_ = Place::kEntry;
    } else {
      Unexpected("an object");
    }
    return true;
  }
  bool end_object() override {
    if (place_ == Place::kEntry) CheckComplete();
    place_ = place_ == Place::kTop ? Place::kEnd : Place::kTop;
    return true;
  }
  bool key(string_t& name) override {
    key_ = name;
    return true;
  }
  bool start_array(std::size_t) override {
    if (place_ == Place::kEntry && key_ == "shape" && !entries_.back().shape) {
      entries_.back().shape.emplace();
      place_ = Place::kShape;
    } else if (place_ == Place::kEntry && key_ == "data_offsets" &&
               entries_.back().offsets.empty()) {
      place_ = Place::kOffsets;
    } else {
      Unexpected("a list");
    }
    return true;
  }
  bool end_array() override {
    place_ = Place::kEntry;
    return true;
  }
  bool string(string_t& text) override {
    if (place_ == Place::kMetadata) {
      if (metadata_) (*metadata_)[key_] = text;
    } else if (place_ == Place::kEntry && key_ == "dtype" && !entries_.back().type) {
      entries_.back().type = TypeFromName(text);
      if (!entries_.back().type) {
        throw source_.Refusal(
            "{} has the number format {}, which is not read; save it as F32 or F16",
            QuotedName(entries_.back().name),
            QuotedName(text));
      }
    } else {
      Unexpected("a text");
    }
    return true;
  }
  bool number_unsigned(number_unsigned_t value) override {
    if (place_ == Place::kShape && value < uint64_t{1} << 60) {
      entries_.back().shape->push_back(static_cast<int64_t>(value));
    } else if (place_ == Place::kOffsets && entries_.back().offsets.size() < 2) {
      entries_.back().offsets.push_back(value);
    } else {
      Unexpected(fmt::format("the number {}", value));
    }
    return true;
  }
  bool number_integer(number_integer_t) override { return Unexpected("a negative number"); }
  bool number_float(number_float_t, const string_t&) override { return Unexpected("a fraction"); }
  bool null() override { return Unexpected("null"); }
  bool boolean(bool) override { return Unexpected("a truth value"); }
  bool binary(binary_t&) override { return Unexpected("binary data"); }
  bool parse_error(std::size_t position,
                   const std::string&,
                   const nlohmann::detail::exception&) override {
    throw source_.Refusal("its header is not JSON at byte {}", kLengthBytes + position);
  }

 private:
  enum class Place { kStart, kTop, kMetadata, kEntry, kShape, kOffsets, kEnd };

  [[noreturn]] bool Unexpected(const std::string& what) {
    throw source_.Refusal("its header has {} after {}, where the safetensors format has none",
                          what,
                          QuotedName(key_));
  }
  void CheckComplete() {
    const Entry& entry = entries_.back();
    if (!entry.type || !entry.shape || entry.offsets.size() != 2) {
      throw source_.Refusal("{} lacks dtype, shape or data_offsets", QuotedName(entry.name));
    }
  }

  const ByteSource& source_;
  WeightMetadata* metadata_;
  Place place_ = Place::kStart;
  std::string key_;
  std::vector<Entry> entries_;
};

// Checks that every byte of the data belongs to exactly one array, as the format requires, so that
// the total read equals the size of the file.
void CheckLayout(const ByteSource& source, std::vector<Entry>& entries, uint64_t data_bytes) {
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.offsets != b.offsets ? a.offsets < b.offsets : a.name < b.name;
  });
  uint64_t expected = 0;
  for (const Entry& entry : entries) {
    const uint64_t begin = entry.offsets[0], end = entry.offsets[1];
    const std::string range = fmt::format(" at [{}, {})", begin, end);
    if (end > data_bytes || begin > end) {
      throw source.Refusal("{}{} is not inside its {} data bytes; the file may be cut short",
                           QuotedName(entry.name),
                           range,
                           data_bytes);
    }
    if (begin != expected) {
      throw source.Refusal(QuotedName(entry.name) + range +
                           (begin < expected ? " overlaps another array" : " leaves a gap"));
    }
    const auto count = static_cast<uint64_t>(CheckedElementCount(source, entry.name, *entry.shape));
    const auto size = static_cast<uint64_t>(ElementBytes(*entry.type));
    if ((end - begin) % size != 0 || (end - begin) / size != count) {
      throw source.Refusal("{} has {} bytes for {} elements of {}",
                           QuotedName(entry.name),
                           end - begin,
                           count,
                           size);
    }
    expected = end;
  }
  if (expected != data_bytes) {
    throw source.Refusal("{} bytes belong to no array", data_bytes - expected);
  }
}

void AppendHalf(const std::string& name, const std::vector<float>& values, std::string& bytes) {
  std::vector<uint16_t> halves(values.size());
  for (size_t i = 0; i < values.size(); ++i) {
    const float value = values[i];
    const uint16_t half = halves[i] = HalfFromFloat(value);
    if (std::isfinite(value) && (half & 0x7c00u) == 0x7c00u) {
      throw InvalidArgument(
          "weight {} holds {}, which half precision cannot hold; write it in single precision",
          QuotedName(name),
          value);
    }
  }
  bytes.append(reinterpret_cast<const char*>(halves.data()), halves.size() * sizeof(uint16_t));
}

}  // namespace

WeightMap ReadSafetensors(const ByteSource& source, WeightMetadata* metadata) {
  uint64_t header_bytes = 0;
  source.ReadAt(0, kLengthBytes, &header_bytes);
  if (header_bytes > kMaxHeaderBytes || header_bytes > source.size() - kLengthBytes) {
    throw source.Refusal("its header claims {} bytes, more than the file or the format allows",
                         header_bytes);
  }
  std::vector<Entry> entries;
  {
    const std::string header = source.ReadString(kLengthBytes, header_bytes);
    if (header.empty() || header[0] != '{') throw source.Refusal("it has no safetensors header");
    HeaderHandler handler(source, metadata);
    nlohmann::json::sax_parse(header, &handler);
    entries = handler.TakeEntries();
  }
  const uint64_t data_begin = kLengthBytes + header_bytes;
  CheckLayout(source, entries, source.size() - data_begin);
  WeightMap weights;
  for (Entry& entry : entries) {
    const auto [at, fresh] = weights.try_emplace(entry.name);
    if (!fresh) throw source.Refusal("{} is there twice", QuotedName(entry.name));
    const auto count = static_cast<uint64_t>(CheckedElementCount(source, entry.name, *entry.shape));
    at->second.values = ReadElements(source, data_begin + entry.offsets[0], *entry.type, count);
    at->second.shape = std::move(*entry.shape);
  }
  return weights;
}

WeightMap ParseSafetensors(std::string_view bytes, WeightMetadata* metadata) {
  return ReadSafetensors(MemorySource(bytes), metadata);
}

std::string SerializeSafetensors(const WeightMap& weights,
                                 bool half,
                                 const WeightMetadata& metadata) {
  return SerializeSafetensors(
      weights, [half](const std::string&) { return half; }, metadata);
}

std::string SerializeSafetensors(const WeightMap& weights,
                                 const std::function<bool(const std::string& name)>& half,
                                 const WeightMetadata& metadata) {
  nlohmann::ordered_json header = nlohmann::ordered_json::object();
  if (!metadata.empty()) header["__metadata__"] = metadata;
  uint64_t offset = 0;
  for (const auto& [name, array] : weights) {
    const MemorySource place({}, "weights to write");
    const auto count = static_cast<uint64_t>(CheckedElementCount(place, name, array.shape));
    if (count != array.values.size()) {
      throw place.Refusal(
          "{} has {} values, its shape says {}", QuotedName(name), array.values.size(), count);
    }
    const uint64_t size = half(name) ? sizeof(uint16_t) : sizeof(float);
    header[name] = {{"dtype", half(name) ? "F16" : "F32"},
                    {"shape", array.shape},
                    {"data_offsets", {offset, offset + count * size}}};
    offset += count * size;
  }
  std::string text;
  try {
    text = header.dump();
  } catch (const nlohmann::json::exception&) {
    throw InvalidArgument("weights to write: a name or the metadata is not UTF-8");
  }
  text.resize((text.size() + 7) / 8 * 8, ' ');  // aligns the data, as the format requires
  const uint64_t header_bytes = text.size();
  std::string bytes(reinterpret_cast<const char*>(&header_bytes), kLengthBytes);
  bytes.reserve(kLengthBytes + header_bytes + offset);
  bytes += text;
  for (const auto& [name, array] : weights) {
    if (half(name)) {
      AppendHalf(name, array.values, bytes);
    } else {
      bytes.append(reinterpret_cast<const char*>(array.values.data()),
                   array.values.size() * sizeof(float));
    }
  }
  return bytes;
}

}  // namespace color3d
