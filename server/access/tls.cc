#include "server/access/tls.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <string>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

template <class T, void (*Free)(T*)>
struct Freer {
  void operator()(T* object) const { Free(object); }
};
using Certificate = std::unique_ptr<X509, Freer<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freer<EVP_PKEY, EVP_PKEY_free>>;

struct Memory {
  explicit Memory(const std::string& bytes)
      : bio(BIO_new_mem_buf(bytes.data(), static_cast<int>(bytes.size()))) {}
  ~Memory() { BIO_free(bio); }
  BIO* bio;
};

Error Unusable(const fs::path& file, const char* what) {
  return Error(ErrorCode::kFailedPrecondition, "{}: {}", file.string(), what);
}

std::string Read(const fs::path& file, const char* flag) {
  try {
    return ReadFile(file);
  } catch (const Error& e) {
    throw Error(ErrorCode::kFailedPrecondition, "{}: {}", flag, e.what());
  }
}

Certificate ReadCertificate(const fs::path& file, const char* flag) {
  const std::string bytes = Read(file, flag);
  const Memory memory(bytes);
  Certificate certificate(PEM_read_bio_X509(memory.bio, nullptr, nullptr, nullptr));
  if (!certificate) throw Unusable(file, "holds no certificate in PEM");
  return certificate;
}

void Check(const TlsFiles& files) {
  if (files.certificate.empty() || files.key.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "TLS needs both --tls-cert and --tls-key (and --tls-client-ca where clients must "
                "show a certificate, too)");
  }
  const Certificate certificate = ReadCertificate(files.certificate, "--tls-cert");
  if (X509_cmp_current_time(X509_get0_notBefore(certificate.get())) > 0) {
    throw Unusable(files.certificate, "the certificate is not valid yet; check the clock");
  }
  if (X509_cmp_current_time(X509_get0_notAfter(certificate.get())) < 0) {
    throw Unusable(files.certificate, "the certificate has expired; renew it");
  }
  const std::string bytes = Read(files.key, "--tls-key");
  const Memory memory(bytes);
  // No prompt for a passphrase.
  const Key key(PEM_read_bio_PrivateKey(
      memory.bio, nullptr, [](char*, int, int, void*) { return 0; }, nullptr));
  if (!key) throw Unusable(files.key, "is not an unencrypted private key in PEM");
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    throw Unusable(files.key, "is not the key of --tls-cert");
  }
  if (!files.client_ca.empty()) ReadCertificate(files.client_ca, "--tls-client-ca");
}

}  // namespace

int64_t CertificateEnd(const fs::path& file) {
  const Certificate certificate = ReadCertificate(file, "--tls-cert");
  std::tm end{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(certificate.get()), &end) != 1) {
    throw Unusable(file, "the expiry time of the certificate is malformed");
  }
  return ::timegm(&end);
}

std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(const TlsFiles& files,
                                                               std::chrono::seconds refresh) {
  namespace tls = grpc::experimental;
  Check(files);
  const auto provider =
      std::make_shared<tls::FileWatcherCertificateProvider>(files.key.string(),
                                                            files.certificate.string(),
                                                            files.client_ca.string(),
                                                            static_cast<unsigned>(refresh.count()));
  tls::TlsServerCredentialsOptions options(provider);
  options.watch_identity_key_cert_pairs();
  if (files.client_ca.empty()) {
    options.set_cert_request_type(GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  } else {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return tls::TlsServerCredentials(options);
}

}  // namespace color3d
