"""A bench of one's own at a serial port: an Arduino Uno with the firmware in ``firmware/`` (README.md).

=================  ====================================================================================
``protocol``       frames, as functions of bytes
``port``           the line, by pyserial
``line``           requests and answers, and samples that come unasked
``stream, motor``  what is sampled; what is set, and the watchdog
``board``          the verbs of :class:`~rotflex.hil.board.Board`
``address``        ``serial:/dev/ttyACM0?supply=12``, and what ``bench.toml`` may say: the entry point
=================  ===================================================================
"""
