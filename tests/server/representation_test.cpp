// Which form of an answer is sent: compressed, in parts, or not at all.
#include <zlib.h>

#include "apps/server/representation.h"
#include "tests/server/served_city.h"

namespace btms::test {
namespace {

const std::string kTile = "/v1/maps/city/tiles/0/0/0";

std::string inflated(const std::string& packed, std::size_t most_bytes) {
  std::string out(most_bytes, '\0');
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  inflateEnd(&stream);
  return out;
}

class Representations : public AnsweredCity {
 protected:
  static Response ask(const std::string& target, const std::map<std::string, std::string>& headers = {},
                      const std::string& method = "GET") {
    Request r = request(method, target);
    r.headers = headers;
    return service().answer(r);
  }
  static std::optional<Response> ask_at_once(const std::string& target,
                                             const std::map<std::string, std::string>& headers) {
    Request r = get(target);
    r.headers = headers;
    return service().answer_at_once(r);
  }
};

TEST_F(Representations, CompressedForThoseWhoTakeIt) {
  for (const std::string& target :
       {kTile, kTile + "?f=json", kTile + "?f=npy&layers=slope,class", std::string("/openapi.json")}) {
    const Response plain = ask(target);
    EXPECT_EQ(header(plain, "Content-Encoding"), "");
    EXPECT_EQ(header(plain, "Vary"), "Accept-Encoding") << target;
    const Response packed = ask(target, {{"accept-encoding", "br, gzip;q=0.5"}});
    ASSERT_EQ(packed.status, 200) << target;
    EXPECT_EQ(header(packed, "Content-Encoding"), "gzip") << target;
    EXPECT_EQ(header(packed, "Vary"), "Accept-Encoding");
    EXPECT_LT(packed.body->size(), plain.body->size() * 2 / 3) << target;
    EXPECT_EQ(inflated(text(packed), plain.body->size() + 1), text(plain)) << target;
    EXPECT_EQ(packed.content_type, plain.content_type);
    if (header(plain, "ETag").empty()) continue;
    std::string tag = header(plain, "ETag");
    tag.insert(tag.size() - 1, "-gzip");
    EXPECT_EQ(header(packed, "ETag"), tag) << "a strong validator names bytes";
  }
}

TEST_F(Representations, LeftAsItIsWhereItDoesNotPayOrIsNotTaken) {
  for (const char* said : {"", "identity", "br", "gzip;q=0", "gzip; q=0.000", "*;q=0", "gzip;q=0, *", "gzipped", ",;"})
    EXPECT_EQ(header(ask(kTile, {{"accept-encoding", said}}), "Content-Encoding"), "") << said;
  for (const char* said : {"gzip", "x-gzip", "*", "br;q=1.0, gzip;q=0.001", "identity;q=0, gzip", "deflate,gzip"})
    EXPECT_EQ(header(ask(kTile, {{"accept-encoding", said}}), "Content-Encoding"), "gzip") << said;
  for (const std::string& target :
       {kTile + "?f=png", kTile + "?f=tif", std::string("/healthz"), std::string("/v1/maps/city/height?x=50&y=50")}) {
    const Response answer = ask(target, {{"accept-encoding", "gzip"}});
    EXPECT_EQ(answer.status, 200);
    EXPECT_EQ(header(answer, "Content-Encoding"), "") << target;
  }
  EXPECT_EQ(ask("/v1/maps/city/tiles/0/0/0?f=exe", {{"accept-encoding", "gzip"}}).status, 400);
}

TEST_F(Representations, EitherFormThatIsHeldIsNotSentAgain) {
  const std::string plain = header(ask(kTile), "ETag");
  const std::string packed = header(ask(kTile, {{"accept-encoding", "gzip"}}), "ETag");
  ASSERT_NE(plain, packed);
  for (const std::string& target : {kTile, std::string("/v1/maps/city"), std::string("/")})
    for (const char* coding : {"identity", "gzip"}) {
      const std::string tag = header(ask(target, {{"accept-encoding", coding}}), "ETag");
      ASSERT_NE(tag, "") << target;
      for (const std::string& held : {tag, "W/" + tag, "\"a\" , " + tag}) {
        const Response answer = ask(target, {{"accept-encoding", coding}, {"if-none-match", held}});
        EXPECT_EQ(answer.status, 304) << target << held;
        EXPECT_EQ(header(answer, "ETag"), tag) << held;
        EXPECT_EQ(header(answer, "Vary"), "Accept-Encoding");
        EXPECT_EQ(header(answer, "Content-Encoding"), "");
      }
    }
  std::string other = plain;
  other[8] = other[8] == '0' ? '1' : '0';
  EXPECT_EQ(ask(kTile, {{"if-none-match", other}}).status, 200);
}

TEST_F(Representations, PartsOfATile) {
  const Response whole = ask(kTile);
  const std::string all = text(whole), size = std::to_string(all.size());
  EXPECT_EQ(header(whole, "Accept-Ranges"), "bytes");
  const std::tuple<const char*, std::size_t, std::size_t> ranges[] = {
      {"bytes=0-63", 0, 63},
      {"bytes=64-", 64, all.size() - 1},
      {"bytes=-100", all.size() - 100, all.size() - 1},
      {"bytes=65599-999999", 65599, all.size() - 1},
      {"bytes=0-99999999999999999999999", 0, all.size() - 1},
      {"bytes=-99999999999999999999999", 0, all.size() - 1},
  };
  for (const auto& [said, first, last] : ranges) {
    const Response part = ask(kTile, {{"range", said}, {"accept-encoding", "gzip"}});
    ASSERT_EQ(part.status, 206) << said;
    EXPECT_EQ(text(part), all.substr(first, last - first + 1)) << said;
    EXPECT_EQ(header(part, "Content-Range"),
              "bytes " + std::to_string(first) + "-" + std::to_string(last) + "/" + size);
    EXPECT_EQ(header(part, "ETag"), header(whole, "ETag"));
    EXPECT_EQ(header(part, "Content-Encoding"), "");
  }
  for (const char* said : {"bytes=65600-", "bytes=99999999999999999999999-", "bytes=-0"}) {
    const Response none = ask(kTile, {{"range", said}});
    EXPECT_EQ(none.status, 416) << said;
    EXPECT_EQ(header(none, "Content-Range"), "bytes */" + size);
    EXPECT_EQ(json(none)["code"], "range");
    EXPECT_EQ(header(none, "X-Map-Revision"), "1");
  }
  // None of a kind that is served: the whole.
  for (const char* said : {"bytes=0-1,5-6", "lines=1-2", "bytes=", "bytes=-", "bytes=5-2", "bytes=a-b", "bytes=+1-2",
                           "bytes=1 - 2", "bytes=0x1-2"})
    EXPECT_EQ(ask(kTile, {{"range", said}}).status, 200) << said;
  EXPECT_EQ(ask(kTile, {{"range", "bytes=0-1"}}, "HEAD").status, 200);
  EXPECT_EQ(ask("/healthz", {{"range", "bytes=0-1"}}).status, 200);
  // Only of that very content.
  EXPECT_EQ(ask(kTile, {{"range", "bytes=0-1"}, {"if-range", header(whole, "ETag")}}).status, 206);
  EXPECT_EQ(ask(kTile, {{"range", "bytes=0-1"}, {"if-range", "\"other\""}}).status, 200);
  EXPECT_EQ(ask(kTile, {{"range", "bytes=0-1"}, {"if-range", "W/" + header(whole, "ETag")}}).status, 200);
  EXPECT_EQ(ask(kTile, {{"range", "bytes=0-1"}, {"if-none-match", header(whole, "ETag")}}).status, 304);
}

TEST_F(Representations, CompressedOnceAndNotWhileReadingRequests) {
  const std::string target = kTile + "?layers=slope";
  EXPECT_FALSE(ask_at_once(target, {})) << "it is not there yet";
  ask(target);
  EXPECT_TRUE(ask_at_once(target, {}));
  EXPECT_FALSE(ask_at_once(target, {{"accept-encoding", "gzip"}})) << "compressing takes time";
  const Response packed = ask(target, {{"accept-encoding", "gzip"}});
  const auto at_once = ask_at_once(target, {{"accept-encoding", "gzip"}});
  ASSERT_TRUE(at_once);
  EXPECT_EQ(at_once->body, packed.body) << "the same bytes, not another copy";
}

TEST_F(Representations, AnswersOutliveTheRevisionTheyWereMadeOf) {
  Service served(options());
  std::map<std::string, Body> before;
  const nlohmann::json old_list = json(served.answer(get("/v1/maps/city/tiles?level=0")));
  for (const auto& tile : old_list["tiles"]) {
    const std::string target = "/v1/maps/city/tiles/" + tile["id"].get<std::string>();
    before[target + tile["etag"].get<std::string>()] = served.answer(get(target)).body;
  }
  run_json({"synth", "--points", "20000", "--seed", "7", "--origin", "120,120", "-o", folder() / "more"});
  run_json({"build", folder() / "more", "-o", map_path(), "--update"});
  ASSERT_TRUE(served.refresh().empty());
  std::size_t same = 0, other = 0;
  const nlohmann::json list = json(served.answer(get("/v1/maps/city/tiles?level=0")));
  for (const auto& tile : list["tiles"]) {
    const std::string target = "/v1/maps/city/tiles/" + tile["id"].get<std::string>();
    const auto kept = before.find(target + tile["etag"].get<std::string>());
    if (kept == before.end()) {
      ++other;
      continue;
    }
    ++same;
    const auto answer = served.answer_at_once(get(target));
    ASSERT_TRUE(answer) << target << " was encoded already";
    EXPECT_EQ(answer->body, kept->second);
  }
  EXPECT_GT(same, 0u);
  EXPECT_GT(other, 0u);
}

// Maps that differ in nothing but their reference system share no GeoTIFF.
TEST_F(Representations, AValidatorNamesTheReferenceSystem) {
  ServiceOptions both = options();
  for (const char* code : {"25832", "25833"}) {
    const std::string name = folder() / code;
    run_json({"synth", "--points", "20000", "--crs", std::string("EPSG:") + code, "-o", name});
    run_json({"build", name, "-o", name + ".btms"});
    both.maps.emplace_back(name + ".btms");
  }
  const Service served(both);
  const Response one = served.answer(get("/v1/maps/25832/tiles/0/0/0?f=tif"));
  const Response other = served.answer(get("/v1/maps/25833/tiles/0/0/0?f=tif"));
  ASSERT_EQ(one.status, 200);
  EXPECT_NE(header(one, "ETag"), header(other, "ETag"));
  EXPECT_NE(text(one), text(other));
}

// A client that asks for ever new combinations of layers of a tile without content fills nothing.
TEST(BodyCaches, CountWhatKeepingNothingTakes) {
  BodyCache cache(1 << 20);
  for (int i = 0; i < 10'000; ++i) cache.keep("tile " + std::to_string(i), body_of({}));
  EXPECT_GT(cache.counts().bytes, std::size_t{1} << 19);
  EXPECT_LE(cache.counts().bytes, std::size_t{1} << 20);
  EXPECT_FALSE(cache.find("tile 0"));
  EXPECT_TRUE(cache.find("tile 9999"));
}

}  // namespace
}  // namespace btms::test
