// Wander for some seconds without hitting anything: mono Avoid.exe [SECONDS] [URL]
using System;
using System.Collections.Generic;
using System.Net.WebSockets;
using System.Runtime.Serialization.Json; // Mono and .NET have it: it reads JSON as XML
using System.Text;
using System.Threading;
using System.Xml;
using System.Xml.Linq;

static class Avoid
{
    static readonly ClientWebSocket Socket = new ClientWebSocket();
    static void Send(string json) => Socket.SendAsync(
        new ArraySegment<byte>(Encoding.UTF8.GetBytes(json)), WebSocketMessageType.Text, true, CancellationToken.None).Wait();

    static XElement Receive()
    {
        var bytes = new byte[65536];
        var length = 0;
        for (WebSocketReceiveResult part = null; part?.EndOfMessage != true; length += part.Count)
        {
            var receiving = Socket.ReceiveAsync(new ArraySegment<byte>(bytes, length, 65536 - length), CancellationToken.None);
            part = receiving.Wait(2000) ? receiving.Result : throw new TimeoutException("no message for 2 s");
        }
        if (length == 0) throw new Exception("elib closed the connection");
        var json = JsonReaderWriterFactory.CreateJsonReader(bytes, 0, length, XmlDictionaryReaderQuotas.Max);
        var message = XElement.Load(json);
        if (!(message.Element("error") is XElement error)) return message;
        throw new Exception($"{error.Element("kind").Value}: {error.Element("message").Value}");
    }
    // The least that each sensor has read so far: that is what it reads in the open, and it is subtracted.
    static readonly Dictionary<string, int> OpenAir = new Dictionary<string, int>();
    static int Count(XElement near, string sensor) => (int)near.Element(sensor) - (OpenAir[sensor] =
        Math.Min((int)near.Element(sensor), OpenAir.TryGetValue(sensor, out var least) ? least : 4095));
    // What is near slows the wheel of the other side, so the robot turns away; in revolutions per second.
    static string Wheel(XElement near, string side) => XmlConvert.ToString(Math.Max(-0.5,
        Math.Round(0.5 - (Count(near, "front_" + side) + Count(near, "diagonal_" + side)) / 800.0, 1)));

    static void Main(string[] words) {
        try {
            Socket.ConnectAsync(new Uri(words.Length > 1 ? words[1] : "ws://127.0.0.1:8700/v1"), CancellationToken.None).Wait();
            Send(@"{""do"": ""hello"", ""id"": 1, ""name"": ""csharp""}");
            Console.WriteLine($"elib {Receive().Element("result").Element("elib").Value}");
            Send(@"{""do"": ""watch"", ""readings"": [""proximity""], ""rate"": 20}");
            var end = DateTime.UtcNow.AddSeconds(words.Length > 0 ? XmlConvert.ToDouble(words[0]) : 10);
            for (var told = ""; DateTime.UtcNow < end;) {
                if (!(Receive().Element("readings")?.Element("proximity") is XElement near)) continue;
                var text = $@"""left"": {Wheel(near, "right")}, ""right"": {Wheel(near, "left")}";
                // Without a new reading we send nothing, and elib stops the robot.
                Send(text == told ? @"{""do"": ""beat""}" : $@"{{""do"": ""set_speed"", {text}}}");
                if (text != told) Console.WriteLine($"{Count(near, "front_left")}, {Count(near, "front_right")}: {text}");
                told = text;
            }
            Send(@"{""do"": ""stop"", ""id"": 2}");
            while (Receive().Element("type").Value != "answer") { }
            Console.WriteLine("the robot stands");
        } catch (Exception error) {
            Console.Error.WriteLine($"ended: {error.GetBaseException().Message}");
            Environment.ExitCode = 1;
        }
        // Mono 6.8 crashes now and then where Main returns while the thread of its sockets works.
        Environment.Exit(Environment.ExitCode);
    }
}
