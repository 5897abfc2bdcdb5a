"""stub"""
class Event: pass
