#include "tests/support/service/test_certificates.h"

#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <stdexcept>

namespace color3d::testing {
namespace fs = std::filesystem;
namespace {

void Require(bool good) {
  if (!good) throw std::runtime_error("OpenSSL cannot make a test certificate");
}

template <class Write>
void WritePem(const fs::path& file, Write&& write) {
  BIO* bio = BIO_new_file(file.c_str(), "w");
  Require(bio != nullptr && write(bio) == 1);
  BIO_free(bio);
}

void AddExtension(X509* certificate, X509* issuer, int nid, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, nid, value);
  Require(extension != nullptr && X509_add_ext(certificate, extension, -1) == 1);
  X509_EXTENSION_free(extension);
}

}  // namespace

TestAuthority::TestAuthority(const fs::path& folder, const std::string& name)
    : folder_(folder),
      file_(folder / (name + ".pem")),
      name_(name),
      key_(EVP_EC_gen("P-256"), EVP_PKEY_free),
      own_(nullptr, X509_free) {
  own_ = Make(name, key_.get(), -60, 3600, /*is_ca=*/true);
  WritePem(file_, [&](BIO* bio) { return PEM_write_bio_X509(bio, own_.get()); });
}

TestAuthority::Certificate TestAuthority::Make(
    const std::string& name, EVP_PKEY* key, long from_s, long until_s, bool is_ca) {
  Certificate certificate(X509_new(), X509_free);
  Require(certificate && key != nullptr);
  X509* x = certificate.get();
  X509_set_version(x, 2);
  ASN1_INTEGER_set(X509_get_serialNumber(x), serial_++);
  X509_gmtime_adj(X509_getm_notBefore(x), from_s);
  X509_gmtime_adj(X509_getm_notAfter(x), until_s);
  X509_set_pubkey(x, key);
  X509_NAME_add_entry_by_txt(X509_get_subject_name(x),
                             "CN",
                             MBSTRING_ASC,
                             reinterpret_cast<const unsigned char*>(name.c_str()),
                             -1,
                             -1,
                             0);
  X509* issuer = is_ca ? x : own_.get();
  X509_set_issuer_name(x, X509_get_subject_name(issuer));
  AddExtension(x, issuer, NID_basic_constraints, is_ca ? "critical,CA:TRUE" : "CA:FALSE");
  if (!is_ca) AddExtension(x, issuer, NID_subject_alt_name, names_.c_str());
  Require(X509_sign(x, key_.get(), EVP_sha256()) != 0);
  return certificate;
}

CertificateFiles TestAuthority::Issue(const std::string& name, long from_s, long until_s) {
  const Key key(EVP_EC_gen("P-256"), EVP_PKEY_free);
  const Certificate certificate = Make(name, key.get(), from_s, until_s, /*is_ca=*/false);
  const CertificateFiles files{folder_ / (name + ".pem"), folder_ / (name + ".key")};
  WritePem(files.certificate, [&](BIO* bio) { return PEM_write_bio_X509(bio, certificate.get()); });
  WritePem(files.key, [&](BIO* bio) {
    return PEM_write_bio_PrivateKey(bio, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  });
  return files;
}

}  // namespace color3d::testing
