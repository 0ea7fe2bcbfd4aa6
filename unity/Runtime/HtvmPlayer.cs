// Plays a stream: a .htvm asset, a file in StreamingAssets or anywhere, or a live stream of a hub. The object's
// MeshRenderer needs a material whose shader shows vertex colours, such as this package's Htvm/Vertex colours.
using System;
using System.IO;
using UnityEngine;

namespace Htvm
{
    [AddComponentMenu("htvm/Player")]
    [RequireComponent(typeof(MeshFilter), typeof(MeshRenderer))]
    public sealed class HtvmPlayer : MonoBehaviour
    {
        [Tooltip("A .htvm asset. If there is none, the address counts.")]
        public HtvmStream stream;
        [Tooltip("A file, in StreamingAssets unless its path is absolute, or a live stream: http://HUB/watch/NAME")]
        public string address = "";
        public bool playOnStart = true;
        public bool loop = true;
        [Tooltip("Of a file: 1 is as captured.")]
        public float speed = 1;

        // Tells what went wrong, in a sentence; playing goes on where it can.
        public event Action<string> Failed;
        // Each frame, once it is in the mesh.
        public event Action<FrameInfo> Shown;

        FrameFile film;     // one of these two: a file,
        LiveBytes live;     // or a live stream,
        Decoder decoder;    // of which these are
        Frame frame;
        byte[] bytes = new byte[1 << 16];
        HtvmMesh mesh;
        Frame inMesh;       // whose frame the mesh shows
        double seconds;
        int shown = -1;     // the film's frame that is in the mesh, or could not be
        string said;        // of the live stream's problems the last that was told

        public bool Playing { get; private set; }
        public bool Live { get { return live != null; } }
        // Seconds since the first frame, and how many there are: of a file.
        public double Time { get { return seconds; } }
        public double Duration { get { return film == null ? 0 : film.Duration / 1e6; } }

        void Start()
        {
            if (film != null || live != null) return;
            if (stream != null) Open(stream.bytes);
            else if (address != "") Open(address);
            Playing = playOnStart;
        }

        // A stream's bytes, which must not change.
        public void Open(byte[] whole)
        {
            Close();
            Attempt(() => film = new FrameFile(whole));
            Playing = playOnStart;
        }

        // A file's path, or a live stream's address.
        public void Open(string where)
        {
            Close();
            if (LiveBytes.IsAddress(where))
            {
                decoder = new Decoder();
                frame = new Frame();
                live = new LiveBytes(where);
                Playing = true;
                return;
            }
            Attempt(() => film = new FrameFile(File.ReadAllBytes(Path.Combine(Application.streamingAssetsPath, where))));
            Playing = playOnStart;
        }

        public void Play()
        {
            if (film != null && seconds >= Duration) seconds = 0;
            Playing = true;
        }

        public void Pause() { Playing = false; }

        // Seeks in a file: the frame of that time is shown at the next update, whether it plays or not.
        public void Seek(double to) { seconds = Math.Min(Math.Max(to, 0), Duration); }

        public void Close()
        {
            if (film != null) film.Dispose();
            if (live != null) live.Dispose();
            if (decoder != null) decoder.Dispose();
            film = null;
            live = null;
            decoder = null;
            frame = inMesh = null;
            seconds = 0;
            shown = -1;
            said = null;
            Playing = false;
        }

        void OnDestroy()
        {
            Close();
            if (mesh != null) Destroy(mesh.Mesh);
        }

        void Update()
        {
            if (live != null) ShowNewest();
            if (film != null) ShowDue();
        }

        // Frames in between are decoded where later ones need them, and the due one is shown.
        void ShowDue()
        {
            int due = film.FrameAt((long)Math.Round(seconds * 1e6));
            if (due != shown)
            {
                shown = due;
                try
                {
                    film.Show(due);
                    ShowFrame(film.Frame, film.Decoder);
                }
                catch (HtvmException exception)
                {
                    Tell(exception.Message);
                }
            }
            if (!Playing) return;
            seconds += speed * UnityEngine.Time.deltaTime;
            double duration = Duration;
            if (seconds >= 0 && seconds < duration) return;
            if (loop) seconds -= duration * Math.Floor(seconds / duration);
            else Pause();
            seconds = Math.Min(Math.Max(seconds, 0), duration);
        }

        // Live, the newest frame is the due one.
        void ShowNewest()
        {
            int count = live.Take(ref bytes);
            var problem = live.Problem;
            if (problem != null && problem != said) Tell(problem);
            said = problem;
            bool came = false, changed = false;
            if (count > 0) decoder.SendBytes(bytes, count);
            while (count > 0)
                try
                {
                    FrameInfo info;
                    if (!decoder.ReceiveFrame(out info)) break;
                    frame.Take(decoder, info);
                    came = true;
                    changed |= frame.TopologyChanged || frame.ReferenceChanged;
                }
                catch (HtvmException exception)
                {
                    Tell(exception.Message); // it costs one packet, behind which the loop goes on
                }
            if (changed) inMesh = null;
            if (came && Playing) ShowFrame(frame, decoder);
        }

        void ShowFrame(Frame from, Decoder by)
        {
            if (mesh == null)
            {
                mesh = new HtvmMesh();
                GetComponent<MeshFilter>().sharedMesh = mesh.Mesh;
            }
            SequenceInfo sequence;
            by.Sequence(out sequence);
            mesh.Show(from, sequence.Up, from != inMesh);
            inMesh = from;
            if (Shown != null) Shown(from.Info);
        }

        void Attempt(Action open)
        {
            try
            {
                open();
            }
            catch (Exception exception) when (exception is HtvmException || exception is IOException || exception is UnauthorizedAccessException)
            {
                Tell(exception.Message);
            }
        }

        void Tell(string text)
        {
            Debug.LogWarning("htvm: " + text);
            if (Failed != null) Failed(text);
        }
    }
}
