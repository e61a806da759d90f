// TLS credentials of the server.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>

namespace color3d {

struct TlsFiles {
  std::filesystem::path certificate;  // PEM, including intermediate certificates
  std::filesystem::path key;          // PEM, unencrypted
  // PEM: clients must present a certificate signed by one of these. Empty: no client certificates.
  std::filesystem::path client_ca;

  bool empty() const { return certificate.empty() && key.empty() && client_ca.empty(); }
};

// Reloads the files every `refresh` (at least 1 s), so that certificates can be renewed without a
// restart. Throws Error{kFailedPrecondition} naming the file and the problem: missing, not PEM, key
// of another certificate, certificate not valid now.
std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(
    const TlsFiles& files, std::chrono::seconds refresh = std::chrono::seconds(10));

// Returns the expiry time of the certificate, seconds since the epoch. Throws as above.
int64_t CertificateEnd(const std::filesystem::path& certificate);

}  // namespace color3d
