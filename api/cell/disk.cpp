#include "api/cell/disk.hpp"

#include <boost/asio/post.hpp>
#include <memory>
#include <utility>

#include "api/cell/kept_file.hpp"

namespace axisd::cell {

void Disk::write(const std::string& path, std::string content, Done done) {
  auto& file = files_[path];
  file.content = std::move(content);
  file.told_next.push_back(std::move(done));
  if (!file.under_way) begin(path);
}

void Disk::begin(const std::string& path) {
  auto& file = files_[path];
  file.under_way = true;
  auto told = std::make_shared<std::vector<Done>>(std::exchange(file.told_next, {}));
  const auto result = std::make_shared<Result<void>>();
  run([path, content = *std::exchange(file.content, {}), result] { *result = write_kept(path, content); },
      [this, path, told, result] {
        auto& written = files_[path];
        written.under_way = false;
        if (written.content) begin(path);
        for (const auto& each : *told) each(*result);
      });
}

void Disk::run(std::function<void()> work, std::function<void()> done) {
  boost::asio::post(thread_, [core = core_, work = std::move(work), done = std::move(done)]() mutable {
    work();
    boost::asio::post(core, std::move(done));
  });
}

}  // namespace axisd::cell
