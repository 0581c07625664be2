// Certificates of a test, made by the openssl command.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "api/tls/live.hpp"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {

/// Authorities end after 30 days, pairs and revocation lists after 2.
class Certificates {
 public:
  explicit Certificates(const TemporaryDirectory& directory) : directory_(directory) {}

  void make_ca(const std::string& name) { make_ca(name, "/CN=" + name); }
  void make_ca(const std::string& name, const std::string& subject) {
    run("openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 30 -subj " +
        subject + " -keyout " + (directory_ / (name + ".key")) + " -out " + (directory_ / (name + ".crt")));
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
  /// Writes NAME.crl of `ca`, which names these and what it named before. `times`: as of `openssl ca`; empty:
  /// from now on.
  void revoke(const std::string& ca, const std::vector<std::string>& names, const std::string& times = "") {
    const auto base = directory_ / ca;
    {
      const std::ofstream at_least_empty(base + ".index", std::ios::app);
    }
    std::ofstream(base + ".cnf") << "[ca]\ndefault_ca = own\n[own]\ndatabase = " << base
                                 << ".index\ndefault_md = sha256\ndefault_crl_days = 2\n";
    const auto of_ca =
        "openssl ca -config " + base + ".cnf -cert " + base + ".crt -keyfile " + base + ".key ";
    for (const auto& name : names) run(of_ca + "-revoke " + (directory_ / (name + ".crt")));
    run(of_ca + "-gencrl " + times + " -out " + base + ".crl");
  }
  /// Of the pair "server", for clients of "ca".
  [[nodiscard]] tls::Files server_files() const {
    return {.certificate = directory_ / "server.crt",
            .key = directory_ / "server.key",
            .client_ca = directory_ / "ca.crt"};
  }
  /// The same as they are served.
  [[nodiscard]] std::shared_ptr<tls::Live> served() const { return served(server_files()); }
  static std::shared_ptr<tls::Live> served(const tls::Files& files) {
    auto live = tls::Live::open(files);
    EXPECT_TRUE(live) << to_string(live.error());
    return live ? *live : nullptr;
  }
  /// An hour ahead of this computer's, on the clock of the fake machine: certificates are valid then.
  static void set_clock(FakeMachine& machine) {
    const auto behind =
        std::chrono::system_clock::now() + std::chrono::hours(1) - machine.wall(machine.now());
    machine.set_now(machine.now() + std::chrono::duration_cast<Duration>(behind));
  }
  /// The text of a file.
  [[nodiscard]] std::string read(const std::string& file) const { return contents(directory_ / file); }
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
    ASSERT_EQ(std::system((command + " >/dev/null 2>&1").c_str()), 0) << command;
  }
  static std::string contents(const std::string& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  const TemporaryDirectory& directory_;
};

}  // namespace axisd::testing
