// Wander for some seconds without hitting anything: ./avoid [SECONDS] [PORT] [HOST]
#include <algorithm>
#include <boost/beast.hpp>
#include <chrono>
#include <cmath>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

namespace asio = boost::asio;
namespace beast = boost::beast;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using nlohmann::json;

asio::io_context context;
beast::websocket::stream<beast::tcp_stream> socket_{context};

void send(const json& message) { socket_.write(asio::buffer(message.dump())); }

json receive() {
    beast::flat_buffer bytes;
    beast::error_code state = asio::error::in_progress;  // asynchronous, because only such a call has a timeout
    socket_.async_read(bytes, [&](beast::error_code result, std::size_t) { state = result; });
    while (state == asio::error::in_progress) context.run_one();
    if (state) throw beast::system_error(state);
    json message = json::parse(beast::buffers_to_string(bytes.data()));
    if (message.contains("error")) throw std::runtime_error(message["error"].dump());
    return message;
}

/** How much more a sensor reads now than in the open, which is the least that it has read so far. */
double above(const json& near, const std::string& sensor) {
    static std::map<std::string, double> open_air;
    const double count = near[sensor], least = open_air.emplace(sensor, count).first->second;
    return count - (open_air[sensor] = std::min(least, count));
}

/** What is near slows the wheel of the other side, so the robot turns away; in revolutions per second. */
double wheel(const json& near, const std::string& side) {
    const double counts = above(near, "front_" + side) + above(near, "diagonal_" + side);
    return std::max(-0.5, std::round(5 - counts / 80) / 10);
}

int main(int count, char** words) try {
    const std::string seconds = count > 1 ? words[1] : "10", port = count > 2 ? words[2] : "8700";
    const std::string host = count > 3 ? words[3] : "127.0.0.1";
    socket_.next_layer().connect(asio::ip::tcp::resolver(context).resolve(host, port));
    socket_.set_option(beast::websocket::stream_base::timeout{2s, 2s, false});
    socket_.handshake(host + ":" + port, "/v1");
    send({{"do", "hello"}, {"id", 1}, {"name", "cpp"}});
    std::cout << receive()["result"] << std::endl;
    send({{"do", "watch"}, {"readings", {"proximity"}}, {"rate", 20}});
    json told;
    for (const auto end = Clock::now() + std::chrono::duration<double>(std::stod(seconds)); Clock::now() < end;) {
        const json near = receive()["readings"]["proximity"];
        const json speeds = {{"do", "set_speed"}, {"left", wheel(near, "right")}, {"right", wheel(near, "left")}};
        send(speeds == told ? json{{"do", "beat"}} : speeds);  // nothing without a new reading: elib stops the robot
        if (speeds != told) std::cout << near << ": " << (told = speeds) << std::endl;
    }
    send({{"do", "stop"}, {"id", 2}});
    while (receive()["type"] != "answer") continue;
    std::cout << "the robot stands" << std::endl;
} catch (const std::exception& error) {
    return std::cerr << "ended: " << error.what() << std::endl, 1;
}
