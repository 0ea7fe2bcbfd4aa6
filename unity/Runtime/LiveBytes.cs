// The bytes of a live stream as they come, from a hub's `GET /watch/NAME`, read by a thread of its own. A connection that
// ends, or brings nothing for some seconds, is made again after a pause that doubles from 0.1 to 3 s.
using System;
using System.IO;
using System.Net;
using System.Threading;

namespace Htvm
{
    public sealed class LiveBytes : IDisposable
    {
        const int SilenceMs = 5000;
        const int MostBytes = 1 << 26; // that wait to be taken
        readonly string address;
        readonly Thread thread;
        readonly ManualResetEvent ended = new ManualResetEvent(false);
        readonly object mutex = new object();
        byte[] waiting = new byte[1 << 16];
        int waitingCount;
        string problem;
        HttpWebRequest request;

        // address: http://HUB/watch/NAME, https, ws or wss.
        public LiveBytes(string address)
        {
            // A WebSocket's address says the same place.
            this.address = address.StartsWith("ws") ? "http" + address.Substring(2) : address;
            thread = new Thread(Read) { IsBackground = true, Name = "htvm live" };
            thread.Start();
        }

        public static bool IsAddress(string text)
        {
            return text.StartsWith("http://") || text.StartsWith("https://") || text.StartsWith("ws://") || text.StartsWith("wss://");
        }

        // What has come since the last call: the array is exchanged for another one, and the number of its bytes returned.
        public int Take(ref byte[] bytes)
        {
            lock (mutex)
            {
                int count = waitingCount;
                if (count == 0) return 0;
                var taken = waiting;
                waiting = bytes;
                waitingCount = 0;
                bytes = taken;
                return count;
            }
        }

        // What the last attempt to connect failed by; null while bytes come.
        public string Problem
        {
            get { lock (mutex) return problem; }
        }

        public void Dispose()
        {
            ended.Set();
            lock (mutex)
                if (request != null) request.Abort();
            thread.Join(1000);
        }

        void Read()
        {
            var piece = new byte[1 << 14];
            int pause = 100;
            while (!ended.WaitOne(0))
            {
                try
                {
                    var asked = (HttpWebRequest)WebRequest.Create(address);
                    asked.Timeout = SilenceMs;
                    asked.ReadWriteTimeout = SilenceMs;
                    lock (mutex) request = asked;
                    using (var response = asked.GetResponse())
                    using (var body = response.GetResponseStream())
                        for (int count; (count = body.Read(piece, 0, piece.Length)) > 0 && !ended.WaitOne(0); pause = 100)
                            Keep(piece, count);
                    Say("the hub ended the stream");
                }
                catch (Exception exception) when (exception is WebException || exception is IOException ||
                                                  exception is ObjectDisposedException || exception is UriFormatException)
                {
                    Say(exception.Message);
                }
                ended.WaitOne(pause);
                pause = Math.Min(2 * pause, 3000);
            }
        }

        void Say(string text)
        {
            lock (mutex) problem = text;
        }

        // A player that takes nothing, as one in the background, must not fill the memory: the connection is made again, and
        // begins with what the newest frame needs.
        void Keep(byte[] piece, int count)
        {
            lock (mutex)
            {
                problem = null;
                if (waitingCount + count > MostBytes)
                {
                    waitingCount = 0;
                    throw new IOException("what came was not taken in time");
                }
                if (waitingCount + count > waiting.Length) Array.Resize(ref waiting, 2 * (waitingCount + count));
                Buffer.BlockCopy(piece, 0, waiting, waitingCount, count);
                waitingCount += count;
            }
        }
    }
}
