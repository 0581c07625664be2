#include "api/web/gateway/assets.hpp"

#include <gtest/gtest.h>

#include "tests/support/temporary_directory.hpp"

namespace axisd::web {
namespace {

TEST(Assets, AreFoundByTheirPaths) {
  const test::TemporaryDirectory directory;
  std::filesystem::create_directory(directory.path() / "assets");
  directory.write("index.html", "<html>");
  directory.write("assets/page-1A2B.js", "code");
  directory.write("assets/page-1A2B.js.gz", "compressed");
  const auto assets = Assets::load(directory.path().string()).value();
  EXPECT_EQ(assets.count(), 2U);
  for (const auto* path : {"/", "/index.html", "/axes/feeder"}) {
    const auto* page = assets.find(path);
    ASSERT_NE(page, nullptr) << path;
    EXPECT_EQ(page->content, "<html>");
    EXPECT_EQ(page->type, "text/html; charset=utf-8");
    EXPECT_FALSE(page->immutable);
    EXPECT_TRUE(page->gzip.empty());
  }
  const auto* code = assets.find("/assets/page-1A2B.js");
  ASSERT_NE(code, nullptr);
  EXPECT_EQ(code->type, "text/javascript; charset=utf-8");
  EXPECT_EQ(code->gzip, "compressed");
  EXPECT_TRUE(code->immutable);
  EXPECT_NE(code->etag, assets.find("/")->etag);
  for (const auto* path :
       {"/../index.html", "/assets/page-1A2B.js.gz", "/assets/../index.html", "/favicon.ico", "index.html"})
    EXPECT_EQ(assets.find(path), nullptr) << path;
}

TEST(Assets, AFolderWithoutAPageIsAnError) {
  const auto none = Assets::load("/nowhere");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message, "/nowhere: cannot be read: No such file or directory");
  const test::TemporaryDirectory directory;
  directory.write("other.html", "<html>");
  const auto other = Assets::load(directory.path().string());
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().message, directory.path().string() + ": no page of axisd-web is there");
}

}  // namespace
}  // namespace axisd::web
