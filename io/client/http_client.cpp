#include "io/client/http_client.h"

#include <utility>  // before Asio, which lacks it

#include <array>
#include <atomic>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <optional>

#include "engine/error.h"
#include "io/client/server_url.h"
#include "io/store/json_field.h"

namespace btms {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using NetError = boost::system::error_code;
using BytesParser = http::response_parser<http::vector_body<std::uint8_t>>;
using StreamParser = http::response_parser<http::buffer_body>;

// What a stranger wrote, fit for a message.
std::string printable(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, 200)) out += c >= 0x20 && c < 0x7f ? c : '?';
  return out;
}

// What a problem's body says, as far as it is one.
std::string detail_of(const std::vector<std::uint8_t>& body) {
  try {
    const Json json = parse_json(body);
    std::string out;
    for (const char* name : {"code", "title", "detail"})
      if (json.is_object() && json.contains(name) && json[name].is_string())
        out += ": " + printable(json[name].get<std::string>());
    return out;
  } catch (const Error&) {
    return {};
  }
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

}  // namespace

std::string percent_encoded(std::string_view text) {
  static constexpr char kDigits[] = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_' ||
        c == '.' || c == '~' || c == ',') {
      out += c;
    } else {
      out += '%';
      out += kDigits[byte >> 4];
      out += kDigits[byte & 15];
    }
  }
  return out;
}

// Every operation is asynchronous and waited for: so it has a deadline, and stop() reaches it.
class HttpClient::Impl {
 public:
  explicit Impl(ClientOptions options) : options_(std::move(options)), url_(parse_server_url(options_.url)) {
    if (options_.token.find_first_of("\r\n") != std::string::npos)
      throw Error(ErrorCode::kUsage, "the token has line breaks");
  }

  HttpAnswer ask(http::verb verb, const std::string& target, const HttpHeaders& headers,
                 std::span<const std::uint8_t> body) {
    const auto request = request_of(verb, target, headers, body);
    if (stream_) {
      try {
        return exchange(request);
      } catch (const Stale&) {  // the server had ended it before it saw the request
      }
    }
    connect();
    try {
      return exchange(request);
    } catch (const Stale&) {
      fail("the server ended the connection without an answer");
    }
  }

  void stream(const std::string& target, const HttpHeaders& headers, const std::string& content_type,
              const std::function<bool(std::string_view)>& heard) {
    const auto request = request_of(http::verb::get, target, headers, {});
    disconnect();
    connect();
    const struct End {
      Impl& impl;
      ~End() { impl.disconnect(); }
    } end{*this};
    deadline(options_.answer);
    write(request);
    StreamParser parser;
    parser.header_limit(static_cast<std::uint32_t>(options_.header_bytes));
    parser.body_limit(boost::none);
    if (const NetError error = read_head(parser)) fail(error);
    const auto& head = parser.get();
    if (head.result_int() != 200 || !lower(as_view(head[http::field::content_type])).starts_with(content_type))
      fail("the server does not stream: status " + std::to_string(head.result_int()));
    if (!heard({})) return;
    std::array<char, 16384> piece;
    while (!parser.is_done()) {
      parser.get().body().data = piece.data();
      parser.get().body().size = piece.size();
      deadline(options_.silence);
      NetError error = wait([&](auto done) { http::async_read_some(*stream_, buffer_, parser, done); });
      if (error == http::error::need_buffer) error = {};
      const std::size_t size = piece.size() - parser.get().body().size;
      if (size > 0 && !heard({piece.data(), size})) return;
      if (error == http::error::end_of_stream || error == asio::error::eof) return;
      if (error) fail(error);
    }
  }

  void stop() {
    stopped_ = true;
    asio::post(io_, [this] {
      if (stream_) stream_->close();
    });
  }

 private:
  struct Stale {};  // a kept connection that died without a byte of the answer
  using Request = http::request<http::span_body<const std::uint8_t>>;

  static std::string_view as_view(beast::string_view text) { return {text.data(), text.size()}; }

  [[noreturn]] void fail(const std::string& why, ErrorCode code = ErrorCode::kFailed) const {
    throw Error(code, why, "http://" + url_.authority());
  }
  [[noreturn]] void fail(NetError error) const {
    if (stopped_) fail("stopped", ErrorCode::kCancelled);
    if (error == beast::error::timeout) fail("the server took too long");
    if (error == http::error::header_limit) fail("the answer's header is too long", ErrorCode::kBadInput);
    if (error == http::error::body_limit) fail("the answer is too long", ErrorCode::kBadInput);
    if (error == http::error::partial_message || error == http::error::end_of_stream)
      fail("the connection ended before the answer did");
    if (error.category() == http::make_error_code(http::error::bad_target).category())
      fail("what answers does not speak HTTP: " + error.message(), ErrorCode::kBadInput);
    fail(error.message());
  }

  Request request_of(http::verb verb, const std::string& target, const HttpHeaders& headers,
                     std::span<const std::uint8_t> body) const {
    if (target.empty() || target[0] != '/' || target.find_first_of(" \r\n\t") != std::string::npos)
      throw Error(ErrorCode::kUsage, "a target must begin with / and have no white space");
    Request request(verb, url_.prefix + target, 11);
    request.set(http::field::host, url_.authority());
    request.set(http::field::user_agent, "btms-client");
    if (!options_.token.empty()) request.set(http::field::authorization, "Bearer " + options_.token);
    for (const auto& [name, value] : headers) {
      if (value.find_first_of("\r\n") != std::string::npos)
        throw Error(ErrorCode::kUsage, "the header " + name + " has line breaks");
      request.set(name, value);
    }
    request.body() = beast::span<const std::uint8_t>(body.data(), body.size());
    if (verb == http::verb::post) request.content_length(body.size());
    return request;
  }

  // Starts an operation and waits until it is done, its deadline has passed or stop() has ended it.
  template <class Start>
  NetError wait(const Start& start) {
    if (stopped_) fail("stopped", ErrorCode::kCancelled);
    NetError result = asio::error::would_block;
    start([&result](NetError error, auto&&...) { result = error; });
    io_.restart();
    io_.run();
    if (stopped_) fail("stopped", ErrorCode::kCancelled);
    return result;
  }
  void deadline(std::chrono::milliseconds most) { stream_->expires_after(most); }

  void disconnect() {
    if (stream_) stream_->close();
    stream_.reset();
    io_.restart();
    io_.run();  // what stop() may have left
    buffer_.clear();
  }
  void connect() {
    if (stopped_) fail("stopped", ErrorCode::kCancelled);
    NetError error;
    const auto places = tcp::resolver(io_).resolve(url_.host, url_.port, error);
    if (error) fail("the host is not known: " + error.message());
    stream_.emplace(io_);
    deadline(options_.connect);
    error = wait([&](auto done) { stream_->async_connect(places, done); });
    if (error) {
      disconnect();
      if (error == beast::error::timeout) fail("no connection in time");
      fail("no connection: " + error.message());
    }
    NetError ignored;
    stream_->socket().set_option(tcp::no_delay(true), ignored);
  }

  void write(const Request& request) {
    const NetError error = wait([&](auto done) { http::async_write(*stream_, request, done); });
    if (error == beast::error::timeout) fail(error);
    // Else there may still be an answer: a server that refuses a long body need not read it.
  }
  template <class Parser>
  NetError read_head(Parser& parser) {
    return wait([&](auto done) { http::async_read_header(*stream_, buffer_, parser, done); });
  }

  HttpAnswer exchange(const Request& request) {
    // Until the answer is whole and fit to be followed by another the connection is not one to keep.
    struct Keep {
      Impl& impl;
      bool kept = false;
      ~Keep() {
        if (!kept) impl.disconnect();
      }
    } keep{*this};
    deadline(options_.answer);
    write(request);
    BytesParser parser;
    parser.header_limit(static_cast<std::uint32_t>(options_.header_bytes));
    parser.body_limit(options_.body_bytes);
    if (const NetError error = read_head(parser)) {
      if (!parser.got_some() && (error == http::error::end_of_stream || error == asio::error::connection_reset ||
                                 error == asio::error::broken_pipe))
        throw Stale();
      fail(error);
    }
    const int status = static_cast<int>(parser.get().result_int());
    if (parser.need_eof()) fail("the answer does not say how long it is", ErrorCode::kBadInput);
    if (!parser.is_done())
      if (const NetError error = wait([&](auto done) { http::async_read(*stream_, buffer_, parser, done); }))
        fail(error);
    HttpAnswer answer;
    answer.status = status;
    for (const auto& field : parser.get())
      answer.headers.emplace(lower(as_view(field.name_string())), std::string(as_view(field.value())));
    answer.body = std::move(parser.get().body());
    // More than the answer: the next one could not be told from it.
    keep.kept = parser.keep_alive() && buffer_.size() == 0;
    check(answer);
    return answer;
  }

  void check(const HttpAnswer& answer) const {
    const int status = answer.status;
    if ((status >= 200 && status < 300) || status == 304) {
      const std::string encoding = answer.header("content-encoding");
      if (!encoding.empty() && encoding != "identity")
        fail("the answer is packed, which was not asked for: " + printable(encoding), ErrorCode::kBadInput);
      return;
    }
    const std::string said = std::to_string(status) + detail_of(answer.body);
    if (status >= 300 && status < 400)
      fail("the server points elsewhere (" + said + "): give the URL of where it is", ErrorCode::kBadInput);
    if (status >= 400 && status < 500) fail("the server refuses: " + said, ErrorCode::kUsage);
    if (status >= 500) fail("the server failed: " + said);
    fail("an answer with status " + std::to_string(status), ErrorCode::kBadInput);
  }

  const ClientOptions options_;
  const ServerUrl url_;
  std::atomic<bool> stopped_{false};
  asio::io_context io_;
  std::optional<beast::tcp_stream> stream_;
  beast::flat_buffer buffer_{std::size_t{1} << 20};
};

HttpClient::HttpClient(ClientOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
HttpClient::~HttpClient() = default;
HttpClient::HttpClient(HttpClient&&) noexcept = default;

HttpAnswer HttpClient::get(const std::string& target, const HttpHeaders& headers) {
  return impl_->ask(http::verb::get, target, headers, {});
}
HttpAnswer HttpClient::post(const std::string& target, std::span<const std::uint8_t> body,
                            const std::string& content_type) {
  return impl_->ask(http::verb::post, target, {{"content-type", content_type}}, body);
}
void HttpClient::stream(const std::string& target, const HttpHeaders& headers, const std::string& content_type,
                        const std::function<bool(std::string_view)>& heard) {
  impl_->stream(target, headers, content_type, heard);
}
void HttpClient::stop() { impl_->stop(); }

}  // namespace btms
