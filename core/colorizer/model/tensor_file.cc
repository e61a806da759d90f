#include "core/colorizer/model/tensor_file.h"

#include <cstdint>
#include <cstring>
#include <optional>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/weights/safetensors.h"

namespace color3d {
namespace {

constexpr size_t kDigestDigits = 64;
constexpr size_t kLengthBytes = 8;  // length field before the header
// Occurs as a key only, since quotes inside metadata texts are escaped.
constexpr char kDigestKey[] = "\"sha256\":\"";

// Position of the digits of the digest, or nothing if the bytes have no such header.
std::optional<size_t> FindDigest(std::string_view bytes) {
  if (bytes.size() < kLengthBytes) return std::nullopt;
  uint64_t length = 0;
  std::memcpy(&length, bytes.data(), kLengthBytes);
  if (length > bytes.size() - kLengthBytes) return std::nullopt;
  const std::string_view header = bytes.substr(kLengthBytes, length);
  const size_t key = header.find(kDigestKey);
  if (key == std::string_view::npos) return std::nullopt;
  const size_t digits = key + std::strlen(kDigestKey);
  if (digits + kDigestDigits > header.size()) return std::nullopt;
  return kLengthBytes + digits;
}

std::string ComputeDigest(std::string_view bytes, size_t digits) {
  Sha256 hash;
  hash.Update(bytes.substr(0, digits));
  hash.Update(std::string(kDigestDigits, '0'));
  hash.Update(bytes.substr(digits + kDigestDigits));
  return hash.FinishHex();
}

}  // namespace

std::string WriteTensorFile(const TensorFile& file, const TensorFormat& format) {
  const WeightMetadata metadata{{"format", std::string(format.name)},
                                {"version", std::to_string(format.version)},
                                {"facts", file.facts.dump()},
                                {"sha256", std::string(kDigestDigits, '0')}};
  std::string bytes = SerializeSafetensors(
      file.arrays, [&](const std::string& name) { return file.half.contains(name); }, metadata);
  const size_t digits = FindDigest(bytes).value();
  bytes.replace(digits, kDigestDigits, Sha256Hex(bytes));
  return bytes;
}

TensorFile ReadTensorFile(std::string_view bytes,
                          const TensorFormat& format,
                          const std::string& what) {
  if (!format.older_start.empty() && bytes.starts_with(format.older_start)) {
    throw InvalidArgument(
        "{} was written by an earlier version of the program; {}", what, format.remedy);
  }
  const std::optional<size_t> digits = FindDigest(bytes);
  if (!digits) throw InvalidArgument("{} is truncated or a file of another kind", what);
  if (ComputeDigest(bytes, *digits) != bytes.substr(*digits, kDigestDigits)) {
    throw InvalidArgument("{} is damaged or truncated (its checksum does not match)", what);
  }
  TensorFile file;
  WeightMetadata metadata;
  file.arrays = ReadSafetensors(MemorySource(bytes, what), &metadata);
  if (metadata["format"] != format.name) {
    throw InvalidArgument("{} is of another kind ({}, not \"{}\")",
                          what,
                          QuotedName(metadata["format"]),
                          format.name);
  }
  if (metadata["version"] != std::to_string(format.version)) {
    const std::string version = QuotedName(metadata["version"]);
    throw InvalidArgument("{} has version {}, but this program reads version {}; {}",
                          what,
                          version.substr(1, version.size() - 2),
                          format.version,
                          format.remedy);
  }
  try {
    file.facts = nlohmann::json::parse(metadata["facts"]);
  } catch (const nlohmann::json::exception& error) {
    throw InvalidArgument("{} has a damaged header: {}", what, error.what());
  }
  return file;
}

}  // namespace color3d
