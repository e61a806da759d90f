#include "client/lib/names.h"

#include <fmt/core.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <random>

#include "core/base/error.h"

namespace color3d::client {

std::string NewUuid() {
  std::random_device device;
  std::array<uint32_t, 4> words{};
  for (uint32_t& word : words) word = device();
  words[1] = (words[1] & 0xffff0fffu) | 0x00004000u;  // version 4
  words[2] = (words[2] & 0x3fffffffu) | 0x80000000u;  // variant of RFC 4122
  return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:04x}{:08x}",
                     words[0],
                     words[1] >> 16,
                     words[1] & 0xffffu,
                     words[2] >> 16,
                     words[2] & 0xffffu,
                     words[3]);
}

std::string ResourceName(const std::string& text, const std::string& collection) {
  const std::string prefix = collection + "/";
  const std::string id = text.starts_with(prefix) ? text.substr(prefix.size()) : text;
  if (id.empty() || id.find('/') != std::string::npos) {
    throw InvalidArgument("'{}' is not a name like {}ID; see `color3d {} list`",
                          text,
                          prefix,
                          collection.substr(0, collection.size() - 1));
  }
  return prefix + id;
}

std::string UploadResource(const std::string& uuid, const FileDigest& digest) {
  return fmt::format("uploads/{}/{}", uuid, BlobResource(digest));
}

std::string BlobResource(const FileDigest& digest) {
  return fmt::format("blobs/{}/{}", digest.sha256, digest.size_bytes);
}

std::string Stem(const std::string& path) { return std::filesystem::path(path).stem().string(); }

}  // namespace color3d::client
