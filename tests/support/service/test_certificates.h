// Certificates for tests, created on demand.
#pragma once

#include <openssl/evp.h>
#include <openssl/x509.h>

#include <filesystem>
#include <memory>
#include <string>

namespace color3d::testing {

struct CertificateFiles {
  std::filesystem::path certificate, key;  // PEM
};

class TestAuthority {
 public:
  // Writes its own certificate to certificate().
  TestAuthority(const std::filesystem::path& folder, const std::string& name);

  const std::filesystem::path& certificate() const { return file_; }
  // Later certificates are for this IP address, too.
  void AddAddress(const std::string& address) { names_ += ",IP:" + address; }
  // For "localhost" and the addresses, valid from `from_s` to `until_s` seconds from now.
  CertificateFiles Issue(const std::string& name, long from_s = -60, long until_s = 3600);

 private:
  using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
  using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;
  Certificate Make(const std::string& name, EVP_PKEY* key, long from_s, long until_s, bool is_ca);

  const std::filesystem::path folder_, file_;
  const std::string name_;
  std::string names_ = "DNS:localhost,IP:127.0.0.1";  // of the certificates it issues
  Key key_;
  Certificate own_;
  long serial_ = 1;
};

}  // namespace color3d::testing
