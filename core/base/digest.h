// SHA-256 (OpenSSL), the name of every blob, colorizer and cached stage.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace color3d {

// 64 lower-case hexadecimal digits.
std::string Sha256Hex(std::string_view bytes);

struct FileDigest {
  std::string sha256;  // 64 lower-case hexadecimal digits
  int64_t size_bytes = 0;
};
// Reads the file in pieces. Throws Error{kNotFound} if it does not exist, kFailedPrecondition if it
// may not be read, kDataLoss if reading fails.
FileDigest DigestFile(const std::filesystem::path& path);

// Incremental form. Not thread-safe.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  void Update(std::string_view bytes);
  // Hexadecimal digest; the object is finished afterwards.
  std::string FinishHex();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// True for 64 lower-case hexadecimal digits.
bool IsSha256Hex(std::string_view text);

}  // namespace color3d
