// Certificates of a test, made by the openssl command.
#pragma once

#include <grpcpp/grpcpp.h>

#include <fstream>
#include <iterator>
#include <string>

#include "api/server/tls.hpp"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {

class Certificates {
 public:
  explicit Certificates(const TemporaryDirectory& directory) : directory_(directory) {}

  void make_ca(const std::string& name) {
    run("openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=" +
        name + " -keyout " + (directory_ / (name + ".key")) + " -out " + (directory_ / (name + ".crt")));
  }
  void make_pair(const std::string& name, const std::string& ca) {
    make_pair(name, ca, "/CN=" + name, "subjectAltName=DNS:localhost,IP:127.0.0.1\n");
  }
  /// `extensions`: as of openssl.cnf; may be empty.
  void make_pair(const std::string& name, const std::string& ca, const std::string& subject,
                 const std::string& extensions) {
    const auto base = directory_ / name;
    std::ofstream(base + ".ext") << extensions;
    run("openssl req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -subj " + subject + " -keyout " +
        base + ".key -out " + base + ".csr");
    run("openssl x509 -req -days 2 -in " + base + ".csr -CA " + (directory_ / (ca + ".crt")) + " -CAkey " +
        (directory_ / (ca + ".key")) + " -CAcreateserial -extfile " + base + ".ext -out " + base + ".crt");
  }
  /// Of the pair "server", for clients of "ca".
  [[nodiscard]] server::TlsFiles server_files() const {
    return {.certificate = directory_ / "server.crt",
            .key = directory_ / "server.key",
            .client_ca = directory_ / "ca.crt"};
  }
  /// Empty name: without a certificate.
  [[nodiscard]] std::shared_ptr<grpc::ChannelCredentials> client(const std::string& name) const {
    grpc::SslCredentialsOptions ssl;
    ssl.pem_root_certs = contents(directory_ / "ca.crt");
    if (!name.empty()) {
      ssl.pem_private_key = contents(directory_ / (name + ".key"));
      ssl.pem_cert_chain = contents(directory_ / (name + ".crt"));
    }
    return grpc::SslCredentials(ssl);
  }

 private:
  static void run(const std::string& command) {
    ASSERT_EQ(std::system((command + " 2>/dev/null").c_str()), 0) << command;
  }
  static std::string contents(const std::string& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  const TemporaryDirectory& directory_;
};

}  // namespace axisd::testing
