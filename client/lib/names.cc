#include "client/lib/names.h"

#include <array>
#include <cstdint>
#include <cstdio>
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
  char text[37];
  std::snprintf(text,
                sizeof(text),
                "%08x-%04x-%04x-%04x-%04x%08x",
                words[0],
                words[1] >> 16,
                words[1] & 0xffffu,
                words[2] >> 16,
                words[2] & 0xffffu,
                words[3]);
  return text;
}

std::string ResourceName(const std::string& text, const std::string& collection) {
  const std::string prefix = collection + "/";
  const std::string id = text.starts_with(prefix) ? text.substr(prefix.size()) : text;
  if (id.empty() || id.find('/') != std::string::npos) {
    throw InvalidArgument("'" + text + "' is not a name like " + prefix + "ID; see `color3d " +
                          collection.substr(0, collection.size() - 1) + " list`");
  }
  return prefix + id;
}

std::string UploadResource(const std::string& uuid, const FileDigest& digest) {
  return "uploads/" + uuid + "/" + BlobResource(digest);
}

std::string BlobResource(const FileDigest& digest) {
  return "blobs/" + digest.sha256 + "/" + std::to_string(digest.size_bytes);
}

std::string Stem(const std::string& path) { return std::filesystem::path(path).stem().string(); }

bool IsUtf8(std::string_view text) {
  for (size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const size_t length = lead < 0x80 ? 1 : lead < 0xc2 ? 0 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    if (length == 0 || lead > 0xf4 || i + length > text.size()) return false;
    for (size_t k = 1; k < length; ++k) {
      if ((static_cast<unsigned char>(text[i + k]) & 0xc0u) != 0x80u) return false;
    }
    // Overlong three- and four-byte forms, surrogates, and what lies beyond U+10FFFF.
    const auto second = length > 1 ? static_cast<unsigned char>(text[i + 1]) : 0;
    if ((lead == 0xe0 && second < 0xa0) || (lead == 0xed && second > 0x9f) ||
        (lead == 0xf0 && second < 0x90) || (lead == 0xf4 && second > 0x8f)) {
      return false;
    }
    i += length;
  }
  return true;
}

}  // namespace color3d::client
