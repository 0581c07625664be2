#include "daemon/store/flight_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include "daemon/store/disk.hpp"
#include "daemon/store/thread.hpp"

namespace axisd::store {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view suffix = ".wire";
/// What describe() has to see.
constexpr std::size_t head_size = 1024;

/// Nothing but what record_name() makes: no way out of the directory.
bool plausible(std::string_view name) {
  return name.ends_with(suffix) && name.find('/') == std::string_view::npos && !name.starts_with('.');
}

WallTime written_at(const fs::directory_entry& entry) {
  std::error_code ignored;  // it was removed meanwhile
  return std::chrono::time_point_cast<WallTime::duration>(
      std::chrono::file_clock::to_sys(entry.last_write_time(ignored)));
}

}  // namespace

FlightFiles::FlightFiles(fs::path directory, std::size_t keep, Executor core)
    : directory_(std::move(directory)), keep_(keep), core_(std::move(core)) {
  thread_ = start_thread("axisd-flight", [this] { run(); });
}

FlightFiles::~FlightFiles() {
  {
    const std::scoped_lock lock(mutex_);
    closing_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void FlightFiles::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return closing_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    const auto job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    job();
    lock.lock();
  }
}

template <class T, class Work>
void FlightFiles::enqueue(Work work, std::function<void(Result<T>)> done) {
  {
    const std::scoped_lock lock(mutex_);
    jobs_.push_back([this, work = std::move(work), done = std::move(done)] {
      post(core_, [done, result = work()] { done(result); });
    });
  }
  wake_.notify_one();
}

void FlightFiles::write(std::string name, Render render, std::function<void(Result<void>)> done) {
  enqueue<void>([this, name = std::move(name), render = std::move(render)] { return save(name, render()); },
                std::move(done));
}

void FlightFiles::list(std::function<void(Result<std::vector<FlightRecord>>)> done) {
  enqueue<std::vector<FlightRecord>>([this] { return found(); }, std::move(done));
}

void FlightFiles::read(std::string name, std::function<void(Result<std::string>)> done) {
  enqueue<std::string>([this, name = std::move(name)] { return load(name); }, std::move(done));
}

/// Under another name first: whoever lists the directory never finds half a record.
Result<void> FlightFiles::save(const std::string& name, const std::string& text) const {
  std::error_code error;
  fs::create_directories(directory_, error);
  if (error) return disk_failed("create", directory_, error.value());
  const auto path = directory_ / name;
  const auto unfinished = directory_ / ("." + name);
  std::ofstream file(unfinished, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  if (!file) return disk_failed("write", unfinished, errno);
  fs::rename(unfinished, path, error);
  if (error) return disk_failed("write", path, error.value());
  remove_oldest();
  return {};
}

void FlightFiles::remove_oldest() const {
  auto records = found();
  if (!records || records->size() <= keep_) return;
  records->resize(records->size() - keep_);
  std::error_code ignored;  // tried again with the next record
  for (const auto& record : *records) fs::remove(directory_ / record.name, ignored);
}

Result<std::vector<FlightRecord>> FlightFiles::found() const {
  std::vector<FlightRecord> records;
  std::error_code error;
  if (!fs::exists(directory_, error)) return records;
  for (const auto& entry : fs::directory_iterator(directory_, error)) {
    FlightRecord record{.name = entry.path().filename().string(), .written_at = written_at(entry)};
    if (!plausible(record.name)) continue;
    std::error_code gone;
    record.size = entry.file_size(gone);
    std::string head(head_size, '\0');
    std::ifstream file(entry.path(), std::ios::binary);
    file.read(head.data(), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(file.gcount()));
    describe(head, record);
    if (!gone) records.push_back(std::move(record));
  }
  if (error) return disk_failed("read", directory_, error.value());
  std::ranges::sort(records, {},
                    [](const FlightRecord& record) { return std::pair(record.written_at, record.name); });
  return records;
}

Result<std::string> FlightFiles::load(const std::string& name) const {
  const auto path = directory_ / name;
  std::error_code error;
  if (!plausible(name) || !fs::is_regular_file(path, error))
    return fail(Reason::invalid_argument, fmt::format("there is no flight record '{}'", name),
                "list them: axisctl bus records");
  std::ifstream file(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file) return disk_failed("read", path, errno);
  return text;
}

}  // namespace axisd::store
