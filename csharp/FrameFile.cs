// Seeking, for C#: a stream in memory whose frames are shown in any order, over csharp/Htvm.cs, beside which it is copied.
//
//     using (var film = new Htvm.FrameFile(File.ReadAllBytes("person.htvm")))
//     {
//         film.Show(film.FrameAt(2000000)); // two seconds in
//         Show(film.Frame.Positions, film.Frame.VertexCount);
//     }
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;

namespace Htvm
{
    // A whole stream in memory, any of whose frames can be shown. One after the other is cheapest; a jump costs the frames
    // that the one shown needs.
    public sealed class FrameFile : IDisposable
    {
        public Decoder Decoder { get; private set; } // another one after a jump to another of several sequences
        public Frame Frame { get; private set; }     // the one that Show has decoded; likewise
        GCHandle memory;
        readonly List<PacketInfo> packets = new List<PacketInfo>();
        readonly List<int> offsets = new List<int>(); // of packets, bytes
        readonly List<int> frames = new List<int>();  // of each frame, its packet
        readonly List<long> times = new List<long>(); // of each frame, µs since the first
        ulong[] needed = new ulong[64];
        int shown = -1;                // the frame that the decoder stands at
        ulong header = ulong.MaxValue; // the packet that began the sequence it is in, if it came there by a jump
        readonly DecoderOptions options;
        HtvmException problem;

        // bytes: must not change as long as this is used. HtvmException if there is no frame in them.
        public FrameFile(byte[] bytes) : this(bytes, Decoder.Options()) { }

        public FrameFile(byte[] bytes, DecoderOptions options)
        {
            this.options = options;
            Decoder = new Decoder(options);
            Frame = new Frame();
            memory = GCHandle.Alloc(bytes, GCHandleType.Pinned);
            FindFrames(bytes.Length);
            if (frames.Count > 0) return;
            Dispose();
            throw new HtvmException(Status.CorruptStream,
                                    string.Format("there is no frame of an htvm stream in the {0} bytes", bytes.Length));
        }

        public int FrameCount { get { return frames.Count; } }
        // Bytes that are no undamaged packet; they are passed over.
        public long DamagedBytes { get; private set; }
        // µs since the first frame.
        public long TimeOf(int frame) { return times[frame]; }
        // µs until the last frame's end, which is shown as long as the one before.
        public long Duration
        {
            get
            {
                int last = frames.Count - 1;
                return times[last] + (last > 0 ? Math.Max(times[last] - times[last - 1], 1) : 33333);
            }
        }

        // The last frame at or before that time, µs since the first.
        public int FrameAt(long time)
        {
            int from = 0, to = frames.Count; // it is one of these
            while (to - from > 1)
            {
                int middle = (from + to) / 2;
                if (times[middle] <= time) from = middle;
                else to = middle;
            }
            return from;
        }

        // Decodes what it takes to show that frame. An exception tells the first thing that could not be decoded; the frames
        // behind it can be shown, and this one too if nothing else was wrong.
        public void Show(int frame)
        {
            if (frame < 0 || frame >= frames.Count) throw new ArgumentOutOfRangeException("frame");
            if (frame == shown) return;
            problem = null;
            // A jump over a few frames takes less than what most frames need.
            if (frame > shown && frame - shown <= 8)
            {
                for (int packet = shown < 0 ? 0 : frames[shown] + 1; packet <= frames[frame]; ++packet)
                    Decode(packet, packet == frames[frame]);
            }
            else
            {
                int count = Needed(frames[frame]);
                StartAt(needed[0]);
                for (int n = 0; n < count; ++n) Decode((int)needed[n], n + 1 == count);
            }
            shown = frame;
            if (problem != null) throw problem;
        }

        public void Dispose()
        {
            Decoder.Dispose();
            if (memory.IsAllocated) memory.Free();
        }

        IntPtr At(int offset) { return new IntPtr(memory.AddrOfPinnedObject().ToInt64() + offset); }

        // Whether one whole undamaged packet begins there.
        bool ReadPacket(int offset, int size, ref PacketInfo info)
        {
            var infoSize = Native.SizeOf<PacketInfo>();
            return Native.htvm_packet_header_read(At(offset), Native.Count(size), ref info, infoSize) == Status.Ok &&
                   info.Bytes <= (ulong)size &&
                   Native.htvm_packet_read(At(offset), (UIntPtr)info.Bytes, ref info, infoSize) == Status.Ok;
        }

        void FindFrames(int size)
        {
            IntPtr dependencies;
            Native.htvm_dependencies_create(IntPtr.Zero, out dependencies);
            long zero = 0, last = 0; // the timestamp at time 0, and the last one
            var info = new PacketInfo();
            for (int offset = 0; offset < size;)
            {
                if (!ReadPacket(offset, size - offset, ref info))
                {
                    ++DamagedBytes;
                    ++offset;
                    continue;
                }
                ulong place;
                uint frame;
                Native.htvm_dependencies_push(dependencies, ref info, out place);
                if (Native.htvm_dependencies_frame(dependencies, out frame) == Status.Ok)
                {
                    // A sequence whose times begin again follows the one before.
                    if (frames.Count == 0 || info.TimestampUs < last) zero = info.TimestampUs - (frames.Count > 0 ? Duration : 0);
                    last = info.TimestampUs;
                    frames.Add(packets.Count);
                    times.Add(last - zero);
                }
                packets.Add(info);
                offsets.Add(offset);
                offset += (int)info.Bytes;
            }
            Native.htvm_dependencies_destroy(dependencies);
        }

        // The packets that this one, of a frame, and those behind it may need, the sequence header first, itself the last; how
        // many there are.
        int Needed(int last)
        {
            IntPtr dependencies;
            Native.htvm_dependencies_create(IntPtr.Zero, out dependencies);
            for (int packet = 0; packet <= last; ++packet)
            {
                ulong place;
                var info = packets[packet];
                Native.htvm_dependencies_push(dependencies, ref info, out place);
            }
            UIntPtr room;
            while (Native.htvm_dependencies_kept(dependencies, needed, Native.Count(needed.Length - 1), out room) == Status.BufferTooSmall)
                needed = new ulong[2 * (int)room + 2];
            Native.htvm_dependencies_destroy(dependencies);
            int count = (int)room;
            if (count == 0 || needed[count - 1] != (ulong)last) needed[count++] = (ulong)last;
            return count;
        }

        // Frames of two sequences may have the same numbers, which a decoder does not tell apart if it comes from elsewhere.
        void StartAt(ulong sequenceHeader)
        {
            if (header == sequenceHeader)
            {
                Decoder.Discard();
                return;
            }
            header = sequenceHeader;
            Decoder.Dispose();
            Decoder = new Decoder(options);
            Frame = new Frame();
        }

        void Decode(int packet, bool take)
        {
            const uint audio = 10, picture = 12;
            if (packets[packet].Kind == audio || packets[packet].Kind == picture) return;
            try
            {
                Decoder.SendPacket(At(offsets[packet]), (int)packets[packet].Bytes);
                FrameInfo info;
                while (Decoder.ReceiveFrame(out info))
                    if (take) Frame.Take(Decoder, info);
            }
            catch (HtvmException exception)
            {
                problem = problem ?? exception;
            }
        }
    }
}
