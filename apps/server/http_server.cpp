#include "apps/server/http_server.h"

#include <atomic>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "apps/server/problem.h"
#include "engine/error.h"

namespace btms {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using ErrorOf = boost::system::error_code;
using Clock = std::chrono::steady_clock;

const char* reason(int status) {
  const auto text = http::obsolete_reason(static_cast<http::status>(status));
  return text.data();  // of a literal
}

std::string head_of(const Response& response, bool keep_alive) {
  std::string head = "HTTP/1.1 " + std::to_string(response.status) + " " + reason(response.status) + "\r\n";
  const bool bodiless = response.status == 204 || response.status == 304 || response.events;
  if (!response.content_type.empty()) head += "Content-Type: " + response.content_type + "\r\n";
  if (!bodiless) head += "Content-Length: " + std::to_string(response.body ? response.body->size() : 0) + "\r\n";
  for (const auto& [name, value] : response.headers) head += name + ": " + value + "\r\n";
  head += keep_alive ? "\r\n" : "Connection: close\r\n\r\n";
  return head;
}

// Values from clients never get into a header, but names of maps and layers might one day.
bool has_line_break(const std::string& text) { return text.find_first_of("\r\n") != text.npos; }

}  // namespace

class Connection;

class HttpServer::Impl {
  // Before io, since connections that io still holds when it ends leave these.
  std::mutex mutex_;  // guards what follows
  std::map<asio::ip::address, std::size_t> by_address_;
  std::set<Connection*> connections_;
  std::size_t count_ = 0;

 public:
  Impl(Service& service, const HttpOptions& options);
  void run(const std::function<void(const std::string&)>& warn);
  void stop();

  Service& service;
  const ServerLimits& limits;
  asio::io_context io;
  asio::thread_pool workers;
  std::atomic<std::size_t> waiting{0};
  tcp::acceptor acceptor;
  const int threads;

  // One more connection of the address, or the code of the problem.
  const char* admit(const asio::ip::address& address);
  void leave(const asio::ip::address& address, Connection* connection);
  void joined(Connection* connection);
  bool stopping() const { return stopping_; }

 private:
  void accept();
  std::atomic<bool> stopping_{false};
  asio::steady_timer pause_{io}, shutdown_{io};
  asio::signal_set signals_{io};
};

// One connection: reads a request, answers it, reads the next. All on its strand.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, HttpServer::Impl& server)
      : socket_(std::move(socket)), server_(server), timer_(socket_.get_executor()) {
    ErrorOf ignored;
    socket_.set_option(tcp::no_delay(true), ignored);
    const auto remote = socket_.remote_endpoint(ignored);
    address_ = remote.address();
  }
  ~Connection() {
    if (admitted_) server_.leave(address_, this);
  }

  void start() {
    asio::dispatch(socket_.get_executor(), [self = shared_from_this()] {
      if (const char* code = self->server_.admit(self->address_)) return self->refuse(code);
      self->admitted_ = true;
      self->server_.joined(self.get());
      self->read_head();
    });
  }

  // The server is about to end: idle connections end now, others after their answer.
  void wind_up() {
    asio::post(socket_.get_executor(), [weak = weak_from_this()] {
      const auto self = weak.lock();
      if (!self) return;
      self->last_ = true;
      if (self->phase_ == Phase::kIdle || self->phase_ == Phase::kEvents) self->close();
    });
  }

 private:
  enum class Phase { kIdle, kHead, kBody, kWork, kWrite, kEvents, kDrain };

  // What is under way ends after so long: with an answer where one can still be given.
  void enter(Phase phase, std::chrono::milliseconds most) {
    phase_ = phase;
    timed_out_ = false;
    timer_.expires_after(most);
    timer_.async_wait([self = weak_from_this(), turn = ++turn_](ErrorOf error) {
      const auto connection = self.lock();
      if (!error && connection && turn == connection->turn_) connection->on_time();
    });
  }
  void on_time() {
    timed_out_ = true;
    ErrorOf ignored;
    switch (phase_) {
      case Phase::kWork:
        ++turn_;  // what the worker brings later is nobody's
        keep_alive_ = false;
        return respond(Problem("takes_long").response());
      case Phase::kEvents:
        return comment();
      default:
        socket_.cancel(ignored);
    }
  }

  void refuse(const char* code) {
    ++server_.service.metrics().refused;
    keep_alive_ = false;
    respond(Problem(code).response());
  }

  void read_next() {
    if (last_ || server_.stopping()) return close();
    if (buffer_.size() > 0) return read_head();  // the next request is there already
    enter(Phase::kIdle, server_.limits.idle);
    socket_.async_wait(tcp::socket::wait_read, [self = shared_from_this()](ErrorOf error) {
      if (error) return self->close();
      self->read_head();
    });
  }

  void read_head() {
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(server_.limits.header_bytes));
    parser_->body_limit(server_.limits.body_bytes);
    enter(Phase::kHead, server_.limits.header);
    http::async_read_header(socket_, buffer_, *parser_, [self = shared_from_this()](ErrorOf error, std::size_t) {
      if (error) return self->fail(error);
      const auto& message = self->parser_->get();
      if (message.target().size() > self->server_.limits.target_bytes) return self->refuse_request("target_too_long");
      self->head_only_ = message.method() == http::verb::head;
      if (beast::iequals(message[http::field::expect], "100-continue")) return self->let_continue();
      self->read_body();
    });
  }

  void let_continue() {
    static constexpr char kContinue[] = "HTTP/1.1 100 Continue\r\n\r\n";
    asio::async_write(socket_, asio::buffer(kContinue, sizeof kContinue - 1),
                      [self = shared_from_this()](ErrorOf error, std::size_t) {
                        if (error) return self->close();
                        self->read_body();
                      });
  }

  void read_body() {
    if (parser_->is_done()) return handle();
    enter(Phase::kBody, server_.limits.body);
    http::async_read(socket_, buffer_, *parser_, [self = shared_from_this()](ErrorOf error, std::size_t) {
      if (error) return self->fail(error);
      self->handle();
    });
  }

  // A request that can't be read to its end.
  void fail(ErrorOf error) {
    if (timed_out_ && (phase_ == Phase::kBody || buffer_.size() > 0)) return refuse_request("slow_request");
    if (error == http::error::header_limit)  // before the end of the first line, or after it
      return refuse_request(parser_->get().target().empty() ? "target_too_long" : "header_too_large");
    if (error == http::error::body_limit) return refuse_request("body_too_large");
    if (error == http::error::end_of_stream ||
        error.category() != http::make_error_code(http::error::bad_target).category())
      return close();
    refuse_request("bad_request");
  }
  void refuse_request(const char* code) {
    keep_alive_ = false;
    head_only_ = false;
    server_.service.metrics().answered("unread", Problem(code).status(), 0, {});
    respond(Problem(code).response());
  }

  void handle() {
    http::request<http::string_body> message = parser_->release();
    parser_.reset();
    keep_alive_ = message.keep_alive() && !last_;
    auto request = std::make_shared<Request>();
    request->method = std::string(message.method_string());
    try {
      parse_target({message.target().data(), message.target().size()}, *request);
    } catch (const Problem& problem) {
      return respond(problem.response());
    }
    for (const auto& field : message) {
      std::string name(field.name_string());
      for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      request->headers[std::move(name)] = std::string(field.value());
    }
    request->body = std::move(message.body());
    if (auto response = server_.service.answer_at_once(*request)) return respond(*std::move(response));
    if (server_.waiting.fetch_add(1) >= server_.limits.waiting) {
      --server_.waiting;
      return respond(Problem("busy").response());
    }
    enter(Phase::kWork, server_.limits.handler);
    asio::post(server_.workers, [self = shared_from_this(), request, turn = turn_]() mutable {
      auto response = std::make_shared<Response>(self->server_.service.answer(*request));
      --self->server_.waiting;
      const auto executor = self->socket_.get_executor();
      asio::post(executor, [self = std::move(self), response, turn] {
        if (turn == self->turn_) self->respond(std::move(*response));
      });
    });
  }

  void respond(Response response) {
    for (const auto& header : response.headers)
      if (has_line_break(header.second)) response = Problem("failed").response();
    if (response.events) return begin_events(response);
    head_ = head_of(response, keep_alive_);
    body_ = head_only_ || response.status == 204 || response.status == 304 ? nullptr : response.body;
    enter(Phase::kWrite, server_.limits.write);
    const std::array<asio::const_buffer, 2> buffers{
        asio::buffer(head_), body_ ? asio::buffer(body_->data(), body_->size()) : asio::const_buffer()};
    asio::async_write(socket_, buffers, [self = shared_from_this()](ErrorOf error, std::size_t) {
      self->body_.reset();
      if (error) return self->close();
      if (!self->keep_alive_) return self->drain();
      self->read_next();
    });
  }

  // What the client is still sending is read, else the end of the connection would take the answer with it.
  void drain() {
    ErrorOf ignored;
    socket_.shutdown(tcp::socket::shutdown_send, ignored);
    enter(Phase::kDrain, std::chrono::seconds(1));
    read_and_forget(std::size_t{1} << 20);
  }
  void read_and_forget(std::size_t most) {
    buffer_.clear();
    socket_.async_read_some(buffer_.prepare(4096), [self = shared_from_this(), most](ErrorOf error, std::size_t n) {
      if (error || n >= most) return self->close();
      self->read_and_forget(most - n);
    });
  }

  void begin_events(const Response& response) {
    if (last_ || server_.stopping()) return close();  // wind_up() came before this could be ended by it
    if (static_cast<std::size_t>(server_.service.metrics().listeners.load()) >= server_.limits.connections / 2)
      return respond(Problem("busy", "too many listeners").response());
    keep_alive_ = false;
    head_ = head_of(response, false);
    if (head_only_) {
      Response no_stream = response;
      no_stream.events.reset();
      return respond(std::move(no_stream));
    }
    events_ = response.events;
    listening_.emplace(server_.service.metrics().listeners);
    head_ += ": events\n\n";
    writing_ = true;
    enter(Phase::kEvents, server_.limits.event_comment);
    events_->on_push([weak = weak_from_this()] {
      if (const auto self = weak.lock()) asio::post(self->socket_.get_executor(), [self] { self->write_events(); });
    });
    watch_for_the_end();
    send(std::exchange(head_, {}));
  }
  void watch_for_the_end() {
    buffer_.clear();
    socket_.async_read_some(buffer_.prepare(512), [self = shared_from_this()](ErrorOf error, std::size_t) {
      if (error) return self->close();
      self->watch_for_the_end();
    });
  }
  void send(std::string text) {
    writing_ = true;
    sent_ = std::move(text);
    sent_at_ = Clock::now();
    asio::async_write(socket_, asio::buffer(sent_), [self = shared_from_this()](ErrorOf error, std::size_t) {
      self->writing_ = false;
      self->sent_.clear();
      if (error) return self->close();
      self->write_events();
    });
  }
  void write_events() {
    if (!events_ || writing_) return;
    if (std::string text = events_->take(); !text.empty()) send(std::move(text));
  }
  void comment() {
    if (!events_) return;
    if (writing_ && Clock::now() - sent_at_ > server_.limits.write) return close();
    enter(Phase::kEvents, server_.limits.event_comment);
    if (!writing_) send(":\n\n");
  }

  void close() {
    ++turn_;
    ErrorOf ignored;
    timer_.cancel(ignored);
    if (events_) events_->on_push({});
    events_.reset();
    listening_.reset();
    socket_.close(ignored);
  }

  struct Listening {
    explicit Listening(std::atomic<std::int64_t>& n) : count(n) { ++count; }
    ~Listening() { --count; }
    Listening(const Listening&) = delete;
    std::atomic<std::int64_t>& count;
  };

  tcp::socket socket_;
  HttpServer::Impl& server_;
  asio::steady_timer timer_;
  asio::ip::address address_;
  beast::flat_buffer buffer_{std::size_t{32} << 10};
  std::optional<http::request_parser<http::string_body>> parser_;
  std::string head_, sent_;
  Body body_;
  std::shared_ptr<EventStream> events_;
  std::optional<Listening> listening_;
  Clock::time_point sent_at_{};
  std::uint64_t turn_ = 0;
  Phase phase_ = Phase::kIdle;
  bool admitted_ = false, keep_alive_ = false, head_only_ = false, timed_out_ = false, last_ = false, writing_ = false;
};

HttpServer::Impl::Impl(Service& served, const HttpOptions& options)
    : service(served),
      limits(served.options().limits),
      io(options.threads),
      workers(static_cast<std::size_t>(options.threads)),
      acceptor(io),
      threads(options.threads) {
  const std::string where = options.address + ":" + std::to_string(options.port);
  ErrorOf error;
  const auto address = asio::ip::make_address(options.address, error);
  if (error) throw Error(ErrorCode::kUsage, "not an address: " + options.address);
  const tcp::endpoint endpoint(address, options.port);
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) throw Error(ErrorCode::kUsage, "cannot listen at " + where + ": " + error.message());
}

const char* HttpServer::Impl::admit(const asio::ip::address& address) {
  const std::lock_guard lock(mutex_);
  if (count_ >= limits.connections) return "busy";
  std::size_t& of_address = by_address_[address];
  if (of_address >= limits.connections_an_address && !address.is_loopback()) return "too_many";
  ++of_address;
  ++count_;
  ++service.metrics().connections;
  return nullptr;
}

void HttpServer::Impl::joined(Connection* connection) {
  const std::lock_guard lock(mutex_);
  connections_.insert(connection);
}

void HttpServer::Impl::leave(const asio::ip::address& address, Connection* connection) {
  const std::lock_guard lock(mutex_);
  connections_.erase(connection);
  if (--by_address_[address] == 0) by_address_.erase(address);
  --count_;
  --service.metrics().connections;
}

void HttpServer::Impl::accept() {
  acceptor.async_accept(asio::make_strand(io), [this](ErrorOf error, tcp::socket socket) {
    if (stopping_) return;
    if (!error) {
      std::make_shared<Connection>(std::move(socket), *this)->start();
      return accept();
    }
    // No descriptors left, say: others will end.
    pause_.expires_after(std::chrono::milliseconds(50));
    pause_.async_wait([this](ErrorOf) {
      if (!stopping_) accept();
    });
  });
}

void HttpServer::Impl::run(const std::function<void(const std::string&)>& warn) {
  signals_.add(SIGINT);
  signals_.add(SIGTERM);
  signals_.async_wait([this](ErrorOf error, int) {
    if (!error) stop();
  });
  accept();
  std::thread watcher([&] {
    while (!stopping_) {
      for (const std::string& wrong : service.refresh()) warn(wrong);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  });
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back([this] { io.run(); });
  io.run();
  for (std::thread& t : others) t.join();
  watcher.join();
  workers.join();
}

void HttpServer::Impl::stop() {
  asio::post(io, [this] {
    if (stopping_.exchange(true)) return;
    ErrorOf ignored;
    acceptor.close(ignored);
    signals_.cancel(ignored);
    pause_.cancel(ignored);
    {
      const std::lock_guard lock(mutex_);
      for (Connection* connection : connections_) connection->wind_up();
    }
    // io ends by itself when nothing is left to do.
    shutdown_.expires_after(limits.shutdown);
    shutdown_.async_wait([this](ErrorOf error) {
      if (!error) io.stop();
    });
    const auto look = std::make_shared<std::function<void()>>();
    *look = [this, look] {
      {
        const std::lock_guard lock(mutex_);
        if (count_ == 0) {
          shutdown_.cancel();
          *look = nullptr;
          return;
        }
      }
      pause_.expires_after(std::chrono::milliseconds(20));
      pause_.async_wait([look](ErrorOf) {
        if (*look) (*look)();
      });
    };
    const auto first = *look;
    first();
  });
}

HttpServer::HttpServer(Service& service, const HttpOptions& options)
    : impl_(std::make_unique<Impl>(service, options)) {}
HttpServer::~HttpServer() = default;
std::uint16_t HttpServer::port() const { return impl_->acceptor.local_endpoint().port(); }
void HttpServer::run(const std::function<void(const std::string&)>& warn) { impl_->run(warn); }
void HttpServer::stop() { impl_->stop(); }

}  // namespace btms
