// Bounded work per client. Stops are exempt: they never ask here.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "buses/error.hpp"

namespace axisd::server {

/// Counts what each client has in progress, so that none can fill the core's queue or the daemon's memory.
/// The transport's own limit is far higher: a client's open calls must never lock out its Stop. Thread: any.
class Admission {
 public:
  struct Limits {
    int calls = 256;   ///< calls that wait for the core, per client
    int streams = 64;  ///< open streams of all kinds, per client
  };
  enum class Kind : std::uint8_t { call, stream };

 private:
  struct Counts {
    int calls = 0, streams = 0;
  };
  struct Book {
    std::mutex mutex;
    std::unordered_map<std::string, Counts> clients;
  };

 public:
  /// One admitted call or stream; gives its place back when destroyed. May outlive the Admission.
  class Ticket {
   public:
    Ticket() = default;
    Ticket(Ticket&&) = default;
    Ticket& operator=(Ticket&& other) noexcept {
      release();
      book_ = std::move(other.book_);
      client_ = std::move(other.client_);
      kind_ = other.kind_;
      return *this;
    }
    ~Ticket() { release(); }
    void release();
    [[nodiscard]] const std::string& client() const { return client_; }

   private:
    friend class Admission;
    Ticket(std::shared_ptr<Book> book, std::string client, Kind kind)
        : book_(std::move(book)), client_(std::move(client)), kind_(kind) {}
    std::shared_ptr<Book> book_;
    std::string client_;
    Kind kind_ = Kind::call;
  };

  explicit Admission(Limits limits) : limits_(limits), book_(std::make_shared<Book>()) {}
  /// Errors: busy.
  [[nodiscard]] Result<Ticket> admit(const std::string& client, Kind kind);

 private:
  const Limits limits_;
  std::shared_ptr<Book> book_;
};

}  // namespace axisd::server
