#include "core/base/text/base64.h"

#include <openssl/evp.h>

#include <algorithm>

namespace color3d {

std::string Base64(std::string_view bytes) {
  constexpr size_t kPiece = size_t{3} << 24;  // OpenSSL counts in int
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  size_t written = 0;
  for (size_t at = 0; at < bytes.size(); at += kPiece) {
    const size_t size = std::min(kPiece, bytes.size() - at);
    written += EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data() + written),
                               reinterpret_cast<const unsigned char*>(bytes.data() + at),
                               static_cast<int>(size));
  }
  text.resize(written);
  return text;
}

}  // namespace color3d
