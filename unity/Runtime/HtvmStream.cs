// What a .htvm file in a project's Assets becomes: its bytes, and what is in them. A player's `stream` takes it.
using UnityEngine;

namespace Htvm
{
    [PreferBinarySerialization]
    public sealed class HtvmStream : ScriptableObject
    {
        [HideInInspector] public byte[] bytes;
        public int frames;
        public float seconds;
        public int vertices; // of the first frame
        public string title;
    }
}
