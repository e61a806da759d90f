#include "core/splat/training/checkpoint.h"

#include <cstring>
#include <utility>

#include "core/base/digest.h"

namespace color3d {
namespace {

// The number counts versions of the format: states of another version start afresh.
constexpr std::string_view kMagic = "C3DTRAIN3";
constexpr size_t kDigestBytes = 64;

}  // namespace

CheckpointWriter::CheckpointWriter(std::string_view fingerprint) {
  Text(kMagic);
  Text(fingerprint);
}

void CheckpointWriter::Text(std::string_view text) {
  Value<uint64_t>(text.size());
  bytes_.append(text);
}

void CheckpointWriter::Block(const ParameterBlock& block) {
  Value<int32_t>(block.rows());
  Value<int64_t>(block.count());
  for (int r = 0; r < block.rows(); ++r) Append(block.Row(r), block.count());
}

std::string CheckpointWriter::Finish() && {
  bytes_ += Sha256Hex(bytes_);
  return std::move(bytes_);
}

CheckpointReader::CheckpointReader(std::string_view bytes, std::string_view fingerprint) {
  if (bytes.size() < kDigestBytes) {
    ok_ = false;
    return;
  }
  rest_ = bytes.substr(0, bytes.size() - kDigestBytes);
  ok_ = Sha256Hex(rest_) == bytes.substr(rest_.size()) && Text() == kMagic && Text() == fingerprint;
}

std::string_view CheckpointReader::Text() {
  const uint64_t size = Count(1);
  const std::string_view text = rest_.substr(0, size);
  rest_.remove_prefix(size);
  return text;
}

void CheckpointReader::Block(ParameterBlock& block) {
  int32_t rows = 0;
  int64_t count = 0;
  Value(rows);
  Value(count);
  if (rows < 0 || rows > 256 || count < 0 || count > (int64_t{1} << 32) ||
      !Has(static_cast<uint64_t>(rows) * static_cast<uint64_t>(count) * sizeof(float))) {
    ok_ = false;
    return;
  }
  block = ParameterBlock(rows, count);
  for (int r = 0; r < rows; ++r) Copy(block.Row(r), count * sizeof(float));
}

uint64_t CheckpointReader::Count(size_t item_bytes) {
  uint64_t count = 0;
  Value(count);
  ok_ = ok_ && count <= rest_.size() / item_bytes;
  return ok_ ? count : 0;
}

bool CheckpointReader::Has(uint64_t bytes) {
  ok_ = ok_ && bytes <= rest_.size();
  return ok_;
}

void CheckpointReader::Copy(void* to, uint64_t bytes) {
  if (bytes == 0 || !Has(bytes)) return;
  std::memcpy(to, rest_.data(), bytes);
  rest_.remove_prefix(bytes);
}

}  // namespace color3d
