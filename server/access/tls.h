// The server's end of TLS.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>

namespace color3d {

struct TlsFiles {
  std::filesystem::path certificate;  // PEM, with the certificates between it and the root
  std::filesystem::path key;          // PEM, without a passphrase
  // PEM: clients must show a certificate that one of these signed. Empty: none is asked for.
  std::filesystem::path client_ca;

  bool empty() const { return certificate.empty() && key.empty() && client_ca.empty(); }
};

// The files are looked at again every `refresh`, a second at least: certificates are renewed
// without a restart. Throws Error{kFailedPrecondition} that names the file and what is wrong with
// it: not there, no PEM, a key of another certificate, or a certificate that is not valid now.
std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(
    const TlsFiles& files, std::chrono::seconds refresh = std::chrono::seconds(10));

// When the certificate in this file ends, seconds since the epoch. Throws as above.
int64_t CertificateEnd(const std::filesystem::path& certificate);

}  // namespace color3d
