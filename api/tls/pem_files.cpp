#include "api/tls/pem_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/x509.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>

#include "api/tls/pem.hpp"
#include "buses/file_descriptor.hpp"

namespace axisd::tls {
namespace {

constexpr std::size_t largest_file = 1U << 20U;

std::unexpected<Error> unreadable(const std::string& path, std::string_view why) {
  return wrong(path, fmt::format("cannot read: {}", why),
               "check the path, and that the service's user may read it");
}

struct Content {
  std::string text;
  mode_t mode = 0;
};

/// Neither an endless file nor a pipe that nobody writes to may hold the start.
Result<Content> read_file(const std::string& path) {
  const auto failed = [&] { return unreadable(path, std::generic_category().message(errno)); };
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) return failed();
  struct stat status{};
  if (fstat(file.get(), &status) != 0) return failed();
  Content content{.text = {}, .mode = status.st_mode};
  std::array<char, 16'384> piece;
  for (;;) {
    const auto count = ::read(file.get(), piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return failed();
    if (count == 0) break;
    content.text.append(piece.data(), static_cast<std::size_t>(count));
    if (content.text.size() > largest_file) return wrong(path, "too large for a PEM file", "check the path");
  }
  if (content.text.empty()) return unreadable(path, "empty");
  return content;
}

/// When something is valid.
struct Period {
  std::optional<WallTime> from, until;  ///< nothing: it does not say
};
Period period_of(const Certificate& certificate) {
  return {.from = time_of(X509_get0_notBefore(certificate.get())),
          .until = time_of(X509_get0_notAfter(certificate.get()))};
}
Period period_of(const RevocationList& list) {
  return {.from = time_of(X509_CRL_get0_lastUpdate(list.get())),
          .until = time_of(X509_CRL_get0_nextUpdate(list.get()))};
}

/// Why `what` ("the certificate") is out of its time at `now`.
std::optional<Error> out_of(const Period& period, const std::string& path, std::string_view what,
                            WallTime now) {
  const auto by_the_clock = [&](std::string_view text, std::string remedy) {
    auto error = wrong(path, text, std::move(remedy)).error();
    error.reason = Reason::configuring;
    return error;
  };
  if (period.until && *period.until < now)
    return by_the_clock(fmt::format("{} has expired ({})", what, to_text(*period.until)), "renew it");
  if (!period.from || *period.from <= now) return std::nullopt;
  return by_the_clock(
      fmt::format("{} is not valid before {}", what, to_text(*period.from)),
      fmt::format("this computer's clock says {}: set it, or give a file that is valid now", to_text(now)));
}

/// Lists of what changed since another one, or of some certificates only, are marked as critical.
bool is_of_a_kind_that_is_not_understood(const RevocationList& list) {
  return X509_CRL_get_ext_by_critical(list.get(), 1, -1) >= 0;
}

/// Reads the files one after the other, and keeps what was found at each.
class Examination {
 public:
  Examination(const Files& files, WallTime now, Demand demand) : files_(files), now_(now), demand_(demand) {
    const auto chain = examine("certificate", files.certificate, contents_.certificate, certificates);
    const auto key = examine("key", files.key, contents_.key, private_key);
    const auto authorities = examine("client_ca", files.client_ca, contents_.client_ca, certificates);
    if (chain) look_at_chain(*chain);
    if (authorities) look_at_authorities(*authorities);
    if (key && (mode_of_key_ & S_IRWXO) != 0)
      add("key", wrong(files.key,
                       fmt::format("every user of this computer may read or change this private key (mode "
                                   "{:04o})",
                                   mode_of_key_ & 07777U),
                       "chmod 640 " + files.key));
    if (chain && key && X509_check_private_key(chain->front().get(), key->get()) != 1)
      add("key", wrong(files.key, "the key does not belong to the certificate " + files.certificate,
                       "install the pair that was made together"));
    if (files.crl.empty()) return;
    const auto lists = examine("crl", files.crl, contents_.crl, revocation_lists);
    if (lists && authorities) look_at_lists(*lists, *authorities);
  }

  [[nodiscard]] Findings& findings() { return findings_; }
  [[nodiscard]] Files& contents() { return contents_; }

 private:
  template <class Decode>
  auto examine(std::string_view key, const std::string& path, std::string& text, Decode decode)
      -> decltype(decode(path, text)) {
    auto content = read_file(path);
    if (!content) {
      add(key, std::unexpected(content.error()));
      return fail(std::move(content).error());
    }
    if (key == "key") mode_of_key_ = content->mode;
    text = std::move(content->text);
    auto decoded = decode(path, text);
    if (!decoded) add(key, std::unexpected(decoded.error()));
    return decoded;
  }

  /// One that cannot be used fails every handshake.
  void look_at_chain(const std::vector<Certificate>& chain) {
    for (const auto& certificate : chain)
      if (auto bad = out_of(period_of(certificate), files_.certificate, "the certificate", now_))
        return add_out_of_time("certificate", *std::move(bad), Demand::usable);
  }

  /// One that cannot be used is an old one, or one for later, as long as another can.
  void look_at_authorities(const std::vector<Certificate>& authorities) {
    std::optional<Error> last;
    for (const auto& authority : authorities) {
      last = out_of(period_of(authority), files_.client_ca, "the certificate", now_);
      if (!last) break;
    }
    if (last) add_out_of_time("client_ca", *std::move(last), Demand::usable);
    if (contents_.client_ca.contains("-----BEGIN X509 CRL-----"))
      add("client_ca", wrong(files_.client_ca, "holds a CRL, which nobody looks at here",
                             "put it into a file of its own, under server.tls.crl"));
  }

  void look_at_lists(const std::vector<RevocationList>& lists, const std::vector<Certificate>& authorities) {
    for (const auto& list : lists) {
      if (issuer_of(list, authorities) == nullptr)
        return add("crl", wrong(files_.crl, "the CRL was not issued by an authority of " + files_.client_ca,
                                "give the one that the authority of the clients has made"));
      if (is_of_a_kind_that_is_not_understood(list))
        return add("crl", wrong(files_.crl, "the CRL is not a complete one of its authority",
                                "give the full list, no delta and no part"));
    }
    // Of no list the time keeps another from being looked at: it may be all that is told.
    for (const auto& list : lists)
      if (auto bad = out_of(period_of(list), files_.crl, "the CRL", now_))
        return add_out_of_time("crl", *std::move(bad), Demand::good);
  }

  /// `least`: the least that is wanted where this is a finding.
  void add_out_of_time(std::string_view key, Error error, Demand least) {
    if (demand_ <= least) findings_.emplace_back(key, std::move(error));
  }

  void add(std::string_view key, std::unexpected<Error> error) {
    findings_.emplace_back(key, std::move(error).error());
  }

  const Files& files_;
  const WallTime now_;
  const Demand demand_;
  mode_t mode_of_key_ = 0;
  Files contents_;
  Findings findings_;
};

}  // namespace

Findings check(const Files& files, WallTime now, Demand demand) {
  return std::move(Examination(files, now, demand).findings());
}

Result<Files> read(const Files& files, WallTime now) {
  Examination examination(files, now, Demand::usable);
  if (!examination.findings().empty()) return fail(std::move(examination.findings().front().second));
  return std::move(examination.contents());
}

}  // namespace axisd::tls
