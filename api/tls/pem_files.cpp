#include "api/tls/pem_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/x509.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "api/tls/pem.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::tls {
namespace {

constexpr std::size_t largest_file = 1U << 20U;

std::unexpected<Error> unreadable(const std::string& path, std::string_view why) {
  return wrong(path, fmt::format("cannot read: {}", why),
               "check the path, and that the service's user may read it");
}

/// Neither an endless file nor a pipe that nobody writes to may hold the start.
Result<std::string> read_file(const std::string& path) {
  const auto failed = [&] { return unreadable(path, std::generic_category().message(errno)); };
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) return failed();
  std::string text;
  std::array<char, 16'384> piece;
  for (;;) {
    const auto count = ::read(file.get(), piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return failed();
    if (count == 0) break;
    text.append(piece.data(), static_cast<std::size_t>(count));
    if (text.size() > largest_file) return wrong(path, "too large for a PEM file", "check the path");
  }
  if (text.empty()) return unreadable(path, "empty");
  return text;
}

bool has_expired(const Certificate& certificate) {
  return X509_cmp_current_time(X509_get0_notAfter(certificate.get())) < 0;
}

std::unexpected<Error> expired(const std::string& path) {
  return wrong(path, "the certificate has expired", "renew it");
}

/// Reads the files one after the other, and keeps what was found at each.
class Examination {
 public:
  explicit Examination(const Files& files) {
    const auto chain = examine("certificate", files.certificate, contents_.certificate, certificates);
    const auto key = examine("key", files.key, contents_.key, private_key);
    const auto authorities = examine("client_ca", files.client_ca, contents_.client_ca, certificates);
    // One that has expired in the chain fails every handshake; among authorities it is an old one.
    if (chain && std::ranges::any_of(*chain, has_expired)) add("certificate", expired(files.certificate));
    if (authorities && std::ranges::all_of(*authorities, has_expired))
      add("client_ca", expired(files.client_ca));
    if (chain && key && X509_check_private_key(chain->front().get(), key->get()) != 1)
      add("key", wrong(files.key, "the key does not belong to the certificate " + files.certificate,
                       "install the pair that was made together"));
  }

  [[nodiscard]] Findings& findings() { return findings_; }
  [[nodiscard]] Files& contents() { return contents_; }

 private:
  template <class Decode>
  auto examine(std::string_view key, const std::string& path, std::string& text, Decode decode)
      -> decltype(decode(path, text)) {
    auto read = read_file(path);
    if (!read) {
      add(key, std::unexpected(read.error()));
      return fail(std::move(read).error());
    }
    text = *std::move(read);
    auto decoded = decode(path, text);
    if (!decoded) add(key, std::unexpected(decoded.error()));
    return decoded;
  }
  void add(std::string_view key, std::unexpected<Error> error) {
    findings_.emplace_back(key, std::move(error).error());
  }

  Files contents_;
  Findings findings_;
};

}  // namespace

Findings check(const Files& files) { return std::move(Examination(files).findings()); }

Result<Files> read(const Files& files) {
  Examination examination(files);
  if (!examination.findings().empty()) return fail(std::move(examination.findings().front().second));
  return std::move(examination.contents());
}

}  // namespace axisd::tls
